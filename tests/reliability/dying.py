"""Dying and hanging by phase, as processes: each leaves all outputs off, and they stay off.

A run on served doubles, with its guard, is killed, stopped, ended, raised in or hung while it
starts, calibrates, is armed, disarms, takes a keyframe, reloads its settings, or is exported. It
does that to itself, within the function that the phase is in, so it strikes there and not near it.
"""

import argparse
import random
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from itertools import cycle, product
from pathlib import Path
from statistics import median
from time import monotonic_ns
from typing import Final

from msgspec import Struct

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import ControlError
from firmware_runtime.links.control import ask
from tests.reliability.in_real_time import add_trials
from tests.reliability.results import Result, ends_at
from tests.support.guarded_run import GuardedRun, guarded_run
from tests.support.trials import PATIENT, ready
from tests.support.waiting import PATIENCE_S, wait_until

_EACH_STEP: Final = "firmware_runtime.runs.arming:Arming.between_steps"
PHASES: Final = {
    "start-up": "firmware_runtime.runs.start:_arming",
    "calibrating": _EACH_STEP,
    "armed": _EACH_STEP,
    "disarming": "firmware_runtime.runs.arming:Arming.disarm",
    "keyframe": "firmware_runtime.recording.blackbox.recorder:Recorder._take_keyframe",
    "reload": "firmware_runtime.runs.tuning:Reloading._reload",
    "export": _EACH_STEP,
}
"""The function in which each strikes."""
KINDS: Final = ("SIGKILL", "SIGSTOP", "SIGTERM", "exception", "hang")
BOARDS: Final = {"tachobot": PATIENT, "detective": (), "balancing": (), "pan_tilt": ()}
_FALLS: Final = frozenset({"balancing"})
"""Boards whose robot does not get up again: each of its trials has doubles of its own."""
_BEFORE_IT_DRIVES: Final = ("start-up", "calibrating")
_STAYS_OFF: Final = 300 * MILLISECOND
_LATEST_STEP: Final = 40
_MISSIONS: Final = 5
_PROGRAM: Final = """
import os, signal, sys
from importlib import import_module
from pathlib import Path
from time import monotonic_ns
order = Path({order!r})
def wrap(place):
    module, _, path = place.partition(":")
    *owners, name = path.split(".")
    owner = import_module(module)
    for each in owners:
        owner = getattr(owner, each)
    whole = getattr(owner, name)
    calls = [0]
    def function(*arguments, **named):
        if order.exists():
            where, kind, count = order.read_text().split()
            if where == place:
                calls[0] += 1
                if calls[0] >= int(count):
                    strike(kind)
        return whole(*arguments, **named)
    setattr(owner, name, function)
def strike(kind):
    order.rename(order.with_suffix(".taken"))
    order.with_suffix(".at").write_text(str(monotonic_ns()))
    if kind == "exception":
        raise TypeError("planted")
    while kind == "hang":
        pass
    os.kill(os.getpid(), getattr(signal, kind))
for place in {places!r}:
    wrap(place)
from firmware_runtime.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


class Trial(Struct, frozen=True):
    """One death: how long until all was off, and what became of it: `off`, `goes on`, or `on`."""

    board: str
    phase: str
    kind: str
    outcome: str
    took_ms: float


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    add_trials(parser, 1000)
    parser.add_argument("--boards", nargs="+", choices=BOARDS, default=list(BOARDS))


def execute(arguments: argparse.Namespace) -> Result:
    """Try each phase and kind on each board in turn, as often as there is time for."""
    until = ends_at(arguments.minutes)
    chance = random.Random(arguments.seed)  # noqa: S311 -- to be repeated
    trials: list[Trial] = []
    for number, board in enumerate(arguments.boards):
        left = len(arguments.boards) - number
        share = (arguments.trials - len(trials)) // left
        ends = time.monotonic() + (until - time.monotonic()) / left
        for each in _on(board, share, ends, chance):
            trials.append(each)
            if each.outcome == "on":
                sys.stdout.write(f"{each.board}, {each.phase}, {each.kind}: an output is on\n")
    return _result(trials)


def _on(board: str, count: int, until: float, chance: random.Random) -> Iterator[Trial]:
    """Try so many on one board; each phase has doubles of its own, since a robot's spin adds up."""
    tried = 0
    alike = [(kind,) for kind in KINDS] if board in _FALLS else [KINDS]
    for phase, kinds in cycle(product(PHASES, alike)):
        with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
            order = Path(folder, "order")
            program = _PROGRAM.format(order=str(order), places=sorted(set(PHASES.values())))
            run = stack.enter_context(
                guarded_run(Path(folder), robot=board, words=BOARDS[board], program=program)
            )
            for kind in kinds:
                if tried == count or time.monotonic() >= until:
                    return
                trial = _Trial(run, order, phase, kind, chance.randrange(1, _LATEST_STEP))
                yield Trial(board, phase, kind, *trial.made())
                tried += 1


class _Trial:
    """One of them, on a guarded run that is used for all."""

    def __init__(self, run: GuardedRun, order: Path, phase: str, kind: str, count: int) -> None:
        self._run, self._order, self._phase, self._kind = run, order, phase, kind
        is_each_step = PHASES[phase] == _EACH_STEP
        self._words = f"{PHASES[phase]} {kind} {count if is_each_step else 1}"
        self._at = order.with_suffix(".at")
        self._asking: threading.Thread | None = None

    def made(self) -> tuple[str, float]:
        """Make it; return what became of it and the ms that it took."""
        for _ in range(_MISSIONS):
            if (made := self._in_a_mission()) is not None:
                return made
        raise AssertionError(
            f"{self._words}: {_MISSIONS} missions ended before\n{self._run.errors()}"
        )

    def _in_a_mission(self) -> tuple[str, float] | None:
        """Make it, unless the mission is over before: then there is nothing to see."""
        for each in (self._order, self._at):
            each.unlink(missing_ok=True)
        with ExitStack() as stack:
            self._begin(stack)
            wait_until(
                lambda: self._has_struck() or self._run.run.poll() is not None,
                "it strikes",
                self._run.errors,
            )
            if not self._has_struck():
                return None
            at = int(self._at.read_text())
            outcome = self._outcome(at)
            took_ms = self._run.until_off_ms(at) if outcome == "off" else 0.0
        if outcome != "goes on":
            self._run.run.kill()
            self._run.run.wait(PATIENCE_S)
        if self._asking is not None:
            self._asking.join(PATIENCE_S)  # or it asks the next run
        return outcome, max(took_ms, 0.0)

    def _has_struck(self) -> bool:
        return self._at.exists() and self._at.read_text() != ""

    def _begin(self, stack: ExitStack) -> None:
        """Bring the run to the phase."""
        run = self._run
        if self._phase in _BEFORE_IT_DRIVES:
            run.run.kill()
            run.run.wait(PATIENCE_S)
            wait_until(lambda: run.is_off, "the guard has switched off", run.errors)
            self._give_the_order()
            arguments, program = run.command
            run.start_instead(*arguments, program=program)
            return
        ready(run)
        if self._phase == "export":
            into = self._order.with_name("export.csv")
            stack.enter_context(run.another("export", run.robot, "-o", into))
        self._give_the_order()
        if self._phase == "disarming":
            self._asking = threading.Thread(target=self._disarm, daemon=True)
            self._asking.start()
        if self._phase == "reload":
            run.run.send_signal(1)

    def _give_the_order(self) -> None:
        whole = self._order.with_suffix(".new")
        whole.write_text(self._words)
        whole.rename(self._order)  # the run finds all of it, or nothing

    def _disarm(self) -> None:
        with suppress(ControlError, OSError):
            ask(self._run.statistics, "disarm")

    def _outcome(self, at: int) -> str:
        """Wait until all is off and see whether it stays so; or the run bears it, and goes on."""
        run = self._run
        if self._kind == "exception" and self._phase not in _BEFORE_IT_DRIVES:
            steps = run.steps()
            wait_until(
                lambda: run.run.poll() is not None or run.steps() > steps + 20,
                "it ends or goes on",
                run.errors,
            )
            if run.run.poll() is None:
                return "goes on"
        wait_until(lambda: run.is_off, "all outputs are off", run.errors)
        seen, until = len(run.lines()), max(monotonic_ns(), at) + _STAYS_OFF
        wait_until(lambda: monotonic_ns() >= until, "some time has passed")
        on = [line for line in run.lines()[seen:] if line.get("value", 0.0) != 0.0]
        return "on" if on else "off"


def _result(trials: Sequence[Trial]) -> Result:
    rows = []
    for phase, kind in product(PHASES, KINDS):
        found = [each for each in trials if (each.phase, each.kind) == (phase, kind)]
        off = [each.took_ms for each in found if each.outcome == "off"]
        rows.append(
            {
                "phase": phase,
                "kind": kind,
                "trials": len(found),
                "off": len(off),
                "went_on": sum(each.outcome == "goes on" for each in found),
                "median_ms": round(median(off), 1) if off else None,
                "worst_ms": round(max(off), 1) if off else None,
            }
        )
    on = sum(each.outcome == "on" for each in trials)
    boards = {name: sum(each.board == name for each in trials) for name in BOARDS}
    return Result(
        name="dying",
        summary=f"{len(trials)} trials, {on} left an output on",
        is_sound=bool(trials) and on == 0,
        figures={
            "trials": len(trials),
            "on": on,
            "boards": boards,
            "rows": rows,
        },
    )
