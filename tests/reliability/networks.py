"""Networks that fail under a robot in two processes: it goes on well, or ends with outputs off.

The path between both ends stands still for a while and then brings all that it kept, is cut for
good, or is slow, lossy, out of order or twice for all of the run, in real time. Whatever happens,
outputs are off in the end, every activation is accounted for, and a robot that is not where it
should be has said why.
"""

import argparse
import json
import math
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from itertools import cycle, islice, product
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
from tests.reliability.results import ROOT, Result, ends_at
from tests.support.waiting import PATIENCE_S, wait_until

BOARDS: Final[Mapping[str, str | None]] = {
    "tachobot": "settled",
    "pan_tilt": "on_target",
    "detective": None,
}
"""Robots, and what its result calls one that is where it should be, if it says so by then."""
PATHS: Final[Mapping[str, str]] = {
    "stands still": "delay=2ms",
    "is cut": "delay=2ms",
    "loses": "delay=2ms,loss=30%",
    "slow": "delay=100ms",
    "unsteady": "delay=40ms,jitter=40ms",
    "out of order": "delay=20ms,reorder=50%",
    "twice": "delay=2ms,duplicate=50%",
}
"""What a path does, and how it is impaired for that."""
FOR_S: Final = 7.0
_BEGINS_S: Final = (0.5, 3.0)
"""Seconds between which a path stands still or is cut, after it is there."""
_LONGEST_S: Final = 1.5


class PathTrial(Trial, frozen=True, kw_only=True):
    """One run over one path, which is what befalls it."""

    at_s: float
    for_s: float
    """How long it stands still."""
    seed: int


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    add_trials(parser, 210)
    parser.add_argument("--at-once", type=int, default=3, help="runs beside one another; default 3")


def execute(arguments: argparse.Namespace) -> Result:
    """Make trials, and return what became of them."""
    until = ends_at(arguments.minutes)
    chance = random.Random(arguments.seed)  # noqa: S311 -- to be repeated
    trials = list(islice(trials_of(chance), arguments.trials))
    with ThreadPoolExecutor(arguments.at_once) as pool:
        found = [each for each in pool.map(lambda one: judged(one, until), trials) if each]
    of = f"over {len(PATHS)} paths that fail"
    return result_of("networks", of, found, tuple(PATHS), tuple(BOARDS))


def trials_of(chance: random.Random) -> Iterator[PathTrial]:
    """Yield trials without end, each board over each path in turn."""
    for path, board in cycle(product(PATHS, BOARDS)):
        at_s, for_s = chance.uniform(*_BEGINS_S), chance.uniform(0.05, _LONGEST_S)
        seed = chance.randrange(1 << 32)
        yield PathTrial(board=board, befalls=path, at_s=at_s, for_s=for_s, seed=seed)


def judged(trial: PathTrial, until: float = math.inf) -> Judged | None:
    """Run one, and judge it from outside; None if it is too late to begin."""
    if time.monotonic() >= until:
        return None
    how = f"{PATHS[trial.befalls]},seed={trial.seed}"
    words = ("run", trial.board, "--stage", "remote", "--impair", how, "--for", str(FOR_S))
    with subprocess.Popen(
        [sys.executable, "-m", "firmware_runtime.cli", *words, "--json"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as run:
        wait_until(lambda: run.poll() is not None or bool(_paths_of(run.pid)), "the path is there")
        if goes_on(run, trial.at_s):
            _disturb(trial, run)
        try:
            out, err = run.communicate(timeout=2 * PATIENCE_S)
        except subprocess.TimeoutExpired:
            run.kill()
            return Judged(trial=trial, outcome="wrong", what="it does not end")
    found = [*_wrong(trial, run.returncode, out, err)]
    if found:
        return Judged(trial=trial, outcome="wrong", what="; ".join(found))
    reason = json.loads(out.splitlines()[-1])["ended"]["reason"]
    return Judged(trial=trial, outcome="ended" if run.returncode else "well", what=reason)


def _disturb(trial: PathTrial, run: subprocess.Popen[str]) -> None:
    """Let the path of this run stand still for a while, or cut it."""
    if trial.befalls not in {"stands still", "is cut"}:
        return
    for path in _paths_of(run.pid):
        os.kill(path, signal.SIGKILL if trial.befalls == "is cut" else signal.SIGSTOP)
        if trial.befalls == "stands still":
            goes_on(run, trial.for_s)
            with suppress(ProcessLookupError):  # it may have ended with the run
                os.kill(path, signal.SIGCONT)


def _paths_of(pid: int) -> Sequence[int]:
    """Return the processes of a run that are its path."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(each) for each in children if b"impaired_path" in _command_of(int(each))]


def _command_of(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except (FileNotFoundError, ProcessLookupError):  # it has ended meanwhile
        return b""


def _wrong(trial: Trial, status: int, out: str, err: str) -> Iterator[str]:
    """Yield what should not be."""
    if "Traceback" in err:
        yield f"a trace: {err[-400:]}"
    if not out.strip():
        yield f"it says nothing, and ends with {status}: {err[-200:]}"
        return
    document = json.loads(out.splitlines()[-1])
    on = [name for name, count in (document["outputs_on"] or {}).items() if count]
    if on:
        yield f"{', '.join(on)} on at the end"
    ends = [document[end] for end in ("controller", "robot") if document.get(end)]
    for end in ends:
        yield from unaccounted(end["statistics"]["models"])
    if status == 0 and not any(map(_has_said, ends)):
        if trial.befalls == "is cut":
            yield "its path was cut, and it says nothing of it"
        arrived = BOARDS[trial.board]
        if arrived is not None and not document["result"][arrived]:
            yield f"not {arrived} in the end, and nothing was said: {document['result']}"


def _has_said(end: Mapping[str, Any]) -> bool:
    """Return whether an end reports a fault, or that its link was or is not good."""
    link = end["link"]
    return bool(end["statistics"]["faults"]) or link["silences"] > 0 or not link["is_good"]
