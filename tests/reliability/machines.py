"""Machines that fail under a robot: a full disk, a state directory that is gone, a date that steps.

A run on served doubles, with its guard, drives in real time while that happens. It goes on with its
outputs on, or they go off and it has said why; once it has ended they are off whatever happened,
and its accounts hold. What the doubles saw is kept elsewhere than what fails.
"""

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import cycle, islice, product, takewhile
from pathlib import Path
from typing import Any, Final

from tests.reliability.in_real_time import (
    Judged,
    Trial,
    add_trials,
    goes_on,
    result_of,
    unaccounted,
)
from tests.reliability.results import Result, ends_at
from tests.support.guarded_run import GuardedRun, guarded_run
from tests.support.trials import PATIENT
from tests.support.waiting import PATIENCE_S, wait_until

BOARDS: Final[Mapping[str, Sequence[str]]] = {
    "tachobot": PATIENT,
    "detective": (),
    "pan_tilt": (),
}
"""Robots, and what their runs are told besides."""
FAILURES: Final = ("the disk is full", "its directory is gone", "the date steps")
LIBRARY: Final = next(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"), None)
"""Of the Debian package `faketime`: it steps the date of the run alone."""
_DISK: Final = "96m"
_BEGINS_S: Final = (0.0, 2.0)
"""Seconds between which it happens, after the robot is driven."""
_LOOKED_AT_S: Final = 1.5
"""How long afterwards it is looked at whether the run goes on."""
_STEPS: Final = ("+1h", "-1h", "+400d", "-400d")


class MachineTrial(Trial, frozen=True, kw_only=True):
    """One failure under one robot."""

    at_s: float
    step: str
    """By how much the date steps."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    add_trials(parser, 90)


def execute(arguments: argparse.Namespace) -> Result:
    """Make trials, and return what became of them."""
    until = ends_at(arguments.minutes)
    chance = random.Random(arguments.seed)  # noqa: S311 -- to be repeated
    can = [each for each in FAILURES if (why := why_not(each)) is None or _left_out(each, why)]
    trials = islice(trials_of(can, chance), arguments.trials if can else 0)
    found = [judged(each) for each in takewhile(lambda _: time.monotonic() < until, trials)]
    of = f"on machines that fail in {len(can)} ways"
    return result_of("machines", of, found, FAILURES, tuple(BOARDS))


def why_not(failure: str) -> str | None:
    """Say what is missing to make this happen, if anything is."""
    if failure == "the disk is full" and not _can_mount():
        return "no permission to mount a small disk"
    if failure == "the date steps" and LIBRARY is None:
        return "expected the Debian package faketime"
    return None


def _can_mount() -> bool:
    tried = subprocess.run(["unshare", "--mount", "true"], check=False, capture_output=True)
    return tried.returncode == 0 and os.geteuid() == 0


def trials_of(failures: Sequence[str], chance: random.Random) -> Iterator[MachineTrial]:
    """Yield trials without end, each failure on each board in turn."""
    for failure, board in cycle(product(failures, BOARDS)):
        at_s, step = chance.uniform(*_BEGINS_S), chance.choice(_STEPS)
        yield MachineTrial(board=board, befalls=failure, at_s=at_s, step=step)


def judged(trial: MachineTrial) -> Judged:
    """Make one, and judge it from outside."""
    with tempfile.TemporaryDirectory() as folder:
        state, outside = Path(folder, "state"), Path(folder, "outside")
        outside.mkdir()
        with _disk(state, is_small=trial.befalls == "the disk is full"):
            date = outside / "date"
            date.write_text("+0")
            with guarded_run(
                state,
                robot=trial.board,
                words=BOARDS[trial.board],
                environment=_dated_by(date) if trial.befalls == "the date steps" else {},
                seen_in=outside,
            ) as run:
                return _judged(trial, run, state, date)


def _left_out(failure: str, why: str) -> bool:
    sys.stdout.write(f"{failure}: left out, {why}\n")
    return False


@contextmanager
def _disk(state: Path, *, is_small: bool) -> Iterator[None]:
    """The directory of a run, on a disk of its own if that is to be filled."""
    state.mkdir()
    if not is_small:
        yield
        return
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={_DISK}", "tmpfs", state], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", state], check=True)


def _dated_by(file: Path) -> Mapping[str, str]:
    return {
        "LD_PRELOAD": str(LIBRARY),
        "FAKETIME_TIMESTAMP_FILE": str(file),
        "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
    }


def _judged(trial: MachineTrial, run: GuardedRun, state: Path, date: Path) -> Judged:
    goes_on(run.run, trial.at_s)
    said_before = len(run.errors())
    if trial.befalls == "the disk is full":
        _fill(state)
    elif trial.befalls == "the date steps":
        assert str(LIBRARY) in Path(f"/proc/{run.run.pid}/maps").read_text()
        date.write_text(trial.step)
    else:
        shutil.rmtree(state)
    went_on = goes_on(run.run, _LOOKED_AT_S) and not run.is_off
    run.run.send_signal(signal.SIGTERM)
    try:
        out, _ = run.run.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        return Judged(trial=trial, outcome="wrong", what="it does not end")
    said = run.errors()[said_before:]
    wrong = [*_wrong(trial, run, out, said, went_on=went_on)]
    outcome = "wrong" if wrong else "well" if went_on else "ended"
    return Judged(trial=trial, outcome=outcome, what="; ".join(wrong) or said.strip())


def _fill(state: Path) -> None:
    """Leave no byte free."""
    with (state / "filling").open("wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(1 << 16))


def _wrong(
    trial: MachineTrial, run: GuardedRun, out: str, said: str, *, went_on: bool
) -> Iterator[str]:
    """Yield what should not be."""
    wait_until(lambda: run.is_off, "the outputs are off", run.errors)
    if "Traceback" in said:
        yield f"a trace: {said[-400:]}"
    if not out.strip():
        yield f"it says nothing, and ends with {run.run.returncode}: {said[-200:]}"
        return
    document: Mapping[str, Any] = json.loads(out.splitlines()[-1])
    yield from unaccounted(document["statistics"]["models"])
    if (recording := document.get("recording")) and not Path(recording).exists():
        yield f"it is said to be recorded in {recording}, which is not there"
    is_told = bool(document["statistics"]["faults"]) or document["ended"]["reason"] != "SIGTERM"
    if not went_on and not is_told:
        yield "its outputs went off, and nothing was said"
    if not went_on and trial.befalls == "the date steps":
        yield f"the date stepped by {trial.step}, and its outputs went off"
    if trial.befalls == "its directory is gone" and "is gone" not in _said_by_guard(run):
        yield "its directory is gone, and its guard does not say so"


def _said_by_guard(run: GuardedRun) -> str:
    """Let the guard end, which has nothing left to watch, and return all that it has said."""
    assert run.guard is not None
    assert run.guard.stdout is not None
    run.guard.terminate()
    return "".join(iter(run.guard.stdout.readline, ""))
