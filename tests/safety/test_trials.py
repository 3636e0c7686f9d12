"""What a guard, or `safe-state`, must withstand, tried again and again: off, and off for a second.

The times go into the table of `docs/safety.md`, see tests/support/trials.py; what is asserted is
that outputs go off and stay off.
"""

import os
import resource
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from subprocess import DEVNULL, Popen
from time import monotonic_ns

import pytest

from tests.support.guarded_run import COMMAND, GuardedRun, guarded_run
from tests.support.trials import PATIENT, TURNING, Trials, ready
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
    with guarded_run(tmp_path, program=program, words=TURNING) as run:
        for watch in trials.of(f"livelock, a time advance of {name}", 300):
            ready(run)
            order.touch()
            assert run.run.stdout is not None
            said = next(line for line in run.run.stdout if line.startswith("failing at"))
            watch(run, int(said.split()[-1]))
            order.unlink()
            wait_until(lambda: run.run.poll() is not None, "the run has ended", run.errors)


def test_a_guard_whose_output_is_a_full_pipe(tmp_path: Path, trials: Trials) -> None:
    with guarded_run(tmp_path, words=TURNING) as run:
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
    with guarded_run(tmp_path, words=TURNING) as run:
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
    with guarded_run(tmp_path, words=TURNING) as run:
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
