"""What must be withstood, tried again and again: off, and off for a second."""

import os
import resource
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from os import kill
from pathlib import Path
from random import Random
from subprocess import DEVNULL, Popen
from time import monotonic_ns

import pytest

from firmware_runtime.links.key_file import write_key
from tests.support.guarded_run import COMMAND, GuardedRun, guarded_run, unhurried
from tests.support.linked_runs import free_port
from tests.support.trials import PATIENT, Trials, ready
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(7200)]

LIVELOCK = """
import sys
from pathlib import Path
from subprocess import DEVNULL
from time import monotonic_ns
from firmware_boards.tachobot import definition
from firmware_boards.tachobot.wiring import Tachobot
from firmware_runtime.devs.atomic import Atomic

class Spinning(Atomic):
    def initialize(self):
        self.hold_in("waiting", 10_000_000)

    def internal(self):
        if self.phase == "spinning":
            done_at = monotonic_ns() + 40_000
            while monotonic_ns() < done_at:
                pass
            self.sigma = {advance}
        elif Path({order!r}).exists():
            print("failing at", monotonic_ns(), flush=True)
            self.hold_in("spinning", {advance})

class WithSpinning(Tachobot):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.add(Spinning("spinning"))

definition.Tachobot = WithSpinning
from firmware_runtime.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def trials() -> Iterator[Trials]:
    trials = Trials()
    yield trials
    trials.keep()


@pytest.mark.parametrize(("robot", "words"), [("tachobot", PATIENT), ("detective", ())])
def test_safe_state_on_an_armed_run(
    tmp_path: Path, trials: Trials, robot: str, words: tuple[str, ...]
) -> None:
    """Counted from the start of its process."""
    with guarded_run(tmp_path, robot=robot, words=words) as run:
        command = [*COMMAND, "safe-state", robot, "--doubles", str(run.socket)]
        for watch in trials.of(f"`safe-state` on an armed run, {robot}", 300):
            ready(run)
            at = monotonic_ns()
            with Popen(command, env=run.environment, stdout=DEVNULL) as stopping:
                watch(run, at)
                assert stopping.wait(PATIENCE_S) == 0


@pytest.mark.parametrize(("name", "advance"), [("1 ns", 1), ("20 us", 20_000)])
def test_a_livelock(tmp_path: Path, trials: Trials, name: str, advance: int) -> None:
    order = tmp_path / "spin"
    program = LIVELOCK.format(order=str(order), advance=advance)
    with guarded_run(tmp_path, program=program, words=PATIENT) as run:
        for watch in trials.of(f"livelock, a time advance of {name}", 300):
            ready(run)
            order.touch()
            assert run.run.stdout is not None
            said = next(line for line in run.run.stdout if line.startswith("failing at"))
            watch(run, int(said.split()[-1]))
            order.unlink()
            wait_until(lambda: run.run.poll() is not None, "the run has ended", run.errors)


def test_a_guard_whose_output_is_a_full_pipe(tmp_path: Path, trials: Trials) -> None:
    with guarded_run(tmp_path, words=PATIENT) as run:
        assert run.guard is not None
        fill(Path(f"/proc/{run.guard.pid}/fd/1"))
        for watch in trials.of("SIGKILL, the guard's output a full pipe", 300):
            ready(run)
            watch(run, run.signal(signal.SIGKILL))
        assert run.guard.poll() is None


def fill(pipe: Path) -> None:
    descriptor = os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
    with suppress(BlockingIOError):
        while True:
            os.write(descriptor, bytes(4096))
    os.close(descriptor)


def overwritten(path: Path) -> None:
    with path.open("r+b") as file:
        file.write(b"\xff" * 4096)


def zeroed(path: Path) -> None:
    with path.open("r+b") as file:
        file.write(bytes(path.stat().st_size))


def cut(path: Path) -> None:
    os.truncate(path, 100)


def made_longer(path: Path) -> None:
    os.truncate(path, 1 << 40)


def copied(path: Path) -> None:
    whole = path.read_bytes()
    path.unlink()
    path.write_bytes(whole)


def replaced(path: Path) -> None:
    path.with_name("other").write_bytes(b"FWRTSTAT" + b"\xff" * 1000)
    path.with_name("other").replace(path)


def made_a_fifo(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def made_a_directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


DAMAGES: tuple[Callable[[Path], None], ...] = (
    overwritten,
    zeroed,
    cut,
    made_longer,
    copied,
    replaced,
    made_a_fifo,
    made_a_directory,
    Path.unlink,
)


def test_statistics_that_are_damaged_or_replaced(tmp_path: Path, trials: Trials) -> None:
    """The clock begins before the damage: some of it ends the run by itself."""
    statistics = tmp_path / "tachobot.stats"
    with guarded_run(tmp_path, words=PATIENT) as run:
        tried = trials.of("statistics damaged or replaced, then SIGKILL", 300)
        for number, watch in enumerate(tried):
            ready(run)
            at = monotonic_ns()
            DAMAGES[number % len(DAMAGES)](statistics)
            run.signal(signal.SIGKILL)
            watch(run, at)
            if statistics.is_dir():
                statistics.rmdir()
        assert run.guard is not None
        assert run.guard.poll() is None


def test_a_guard_that_gets_no_more_memory(tmp_path: Path, trials: Trials) -> None:
    with guarded_run(tmp_path, words=PATIENT) as run:
        assert run.guard is not None
        for watch in trials.of("SIGKILL, the guard gets no more memory", 300):
            ready(run)
            limit_memory(run, run.guard.pid)
            watch(run, run.signal(signal.SIGKILL))
            resource.prlimit(run.guard.pid, resource.RLIMIT_AS, (resource.RLIM_INFINITY,) * 2)
        assert run.guard.poll() is None


def limit_memory(run: GuardedRun, process: int) -> None:
    """Let a process have the address space that it has, and no page more."""
    assert run.run.poll() is None
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[0])
    most = pages * resource.getpagesize()
    resource.prlimit(process, resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))


GOAL_MS = 510
"""`timeout_s` of the link and one period of the loop."""


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
        words = ["run", "tachobot", "--role", "controller", "--link", self.link, "--json"]
        words += [*unhurried("tachobot"), *PATIENT]
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
        words = (*PATIENT, "--role", "robot", "--link", ends.link)
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
