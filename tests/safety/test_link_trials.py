"""`kill -9` of the parts of a robot in two processes, again and again: off in time, and for good.

The robot's own stop without commands is put off (`PATIENT`), so that what switches off is the link,
the run's end, or the guard. The times go into the table of `docs/safety.md`.
"""

import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os import kill
from pathlib import Path
from random import Random
from time import monotonic_ns

import pytest

from firmware_runtime.links.key_file import write_key
from tests.support.guarded_run import COMMAND, GuardedRun, guarded_run
from tests.support.linked_runs import free_port
from tests.support.trials import TURNING, Trials, ready
from tests.support.waiting import wait_until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(7200)]
GOAL_MS = 510
"""`timeout_s` of the link and one period of the loop."""


@pytest.fixture(scope="module")
def trials() -> Iterator[Trials]:
    trials = Trials()
    yield trials
    trials.keep()


class TwoEnds:
    """A guarded robot's end on served doubles, and its controller's over UDP."""

    def __init__(self, link: str, directory: Path) -> None:
        self.link = link
        self.run: GuardedRun
        self.controller: subprocess.Popen[bytes] | None = None
        self._errors = directory / "controller.log"
        self._random = Random(link)  # noqa: S311 -- when to kill is to be repeated

    def start_controller(self) -> None:
        self.stop_controller()
        words = ["run", "tachobot", "--role", "controller", "--link", self.link, "--json", *TURNING]
        with self._errors.open("a") as errors:
            self.controller = subprocess.Popen(
                [*COMMAND, *words, "--statistics", str(self._errors.with_suffix(".stats"))],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=errors,
            )

    def stop_controller(self) -> None:
        if self.controller is not None:
            self.controller.kill()
            self.controller.wait()

    def ready(self) -> None:
        """Both ends are there, it drives, and some time has passed since."""
        ready(self.run, self._keep_controller)
        at = monotonic_ns() + self._random.randrange(200_000_000)
        wait_until(lambda: monotonic_ns() >= at, "the instant has come")

    def _keep_controller(self) -> None:
        """Start it again once it has ended, as it does soon after its carrier."""
        if self.controller is None or self.controller.poll() is not None:
            self.start_controller()

    def kill_controller(self) -> None:
        assert self.controller is not None
        self.controller.kill()

    def kill_its_carrier(self) -> None:
        assert self.controller is not None
        kill(carrier_of(self.controller.pid), signal.SIGKILL)

    def kill_the_robot_s_carrier(self) -> None:
        kill(carrier_of(self.run.run.pid), signal.SIGKILL)

    def kill_the_robot(self) -> None:
        self.run.signal(signal.SIGKILL)


def carrier_of(process: int) -> int:
    """The only child of a run."""
    (child,) = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return int(child)


@contextmanager
def two_ends(directory: Path) -> Iterator[TwoEnds]:
    key = directory / "link.key"
    write_key(key)
    ends = TwoEnds(f"udp:127.0.0.1:{free_port()},key={key}", directory)
    try:
        ends.start_controller()
        words = (*TURNING, "--role", "robot", "--link", ends.link)
        with guarded_run(directory, words=words) as ends.run:
            yield ends
    finally:
        ends.stop_controller()


KILLED: dict[str, Callable[[TwoEnds], None]] = {
    "the controller": TwoEnds.kill_controller,
    "the controller's carrier": TwoEnds.kill_its_carrier,
    "the robot's carrier": TwoEnds.kill_the_robot_s_carrier,
    "the robot's end, which has a guard": TwoEnds.kill_the_robot,
}


@pytest.mark.parametrize("what", KILLED)
def test_outputs_go_off_when_a_part_of_a_linked_robot_is_killed(
    tmp_path: Path, trials: Trials, what: str
) -> None:
    with two_ends(tmp_path) as ends:
        for watch in trials.of(f"over UDP, SIGKILL of {what}", GOAL_MS):
            ends.ready()
            at = monotonic_ns()
            KILLED[what](ends)
            watch(ends.run, at)
