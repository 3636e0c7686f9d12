"""Whether runs in which much goes wrong are the same when they are run again: `bench replay`.

Each run has a seed. TachoBot and the detective, on doubles of their own that fail and brown out, or
on doubles that are served, are stalled, armed, disarmed, retuned, reloaded and sent values to at
random instants; a third is killed by -9, the others end by a signal or by their time. Then `replay`
of the recording has to find every value, transfer and count the same.

Before that, how many times as much robot time as processor time a replay of TachoBot's run takes,
start of the command included; printed last.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.replay.seeded_run import SeededRun
from benchmarks.shared.results import (
    conditions,
    finish,
    positive,
)
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.errors import Status
from firmware_runtime.system.signals import exit_on_signals

SUMMARY = "Whether runs in which much goes wrong replay the same, and how fast a replay is."
SPEED_TURNS = 3


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument("--runs", type=positive, default=100, metavar="N", help="default 100")
    parser.add_argument(
        "--seed", type=positive, default=1, metavar="N", help="of the first run; default 1"
    )
    parser.add_argument(
        "--speed-of",
        type=positive_number,
        default=60.0,
        metavar="S",
        help="robot time of the run whose replay is timed; default 60",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run and run again; status 1 if any run is not its replay."""
    before, results = conditions(), []
    with exit_on_signals():
        speed = _speed(arguments.speed_of)
        for seed in range(arguments.seed, arguments.seed + arguments.runs):
            results.append(_run_and_replay(seed))
            if sys.stderr.isatty():
                sys.stderr.write(f"\r{len(results)} of {arguments.runs}\x1b[K")
    identical = sum(each["identical"] for each in results)
    report = {"conditions": before, "identical": identical, "runs": results, "ratio": speed}
    finish(arguments, "replay", report, partial(_lines, speed_of=arguments.speed_of))
    return Status.OK if identical == len(results) else Status.MODEL_ERROR


def _speed(span_s: float) -> float:
    """Robot time of a run by the processor time of the fastest of some replays of it."""
    with TemporaryDirectory(prefix="replay-bench-") as directory:
        folder = Path(directory)
        words = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", str(span_s))
        _command(folder, *words).check_returncode()
        taken = []
        for _ in range(SPEED_TURNS):
            before = _children_s()
            _command(folder, "replay", "tachobot").check_returncode()
            taken.append(_children_s() - before)
    return span_s / min(taken)


def _children_s() -> float:
    """Processor time of all processes that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _run_and_replay(seed: int) -> dict[str, Any]:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="replay-bench-")))
        random = Random(seed)  # noqa: S311 -- repeatable, not secret
        run = SeededRun(random, seed, folder)
        said = run.carried_out(stack)
        return {"seed": seed, **said, **_replayed(folder, run.board)}


def _replayed(folder: Path, board: str) -> dict[str, Any]:
    ended = _command(folder, "replay", board, "--json")
    try:
        said: dict[str, Any] = json.loads(ended.stdout)
    except ValueError:
        return {"identical": False, "error": ended.stderr.strip()[-400:]}
    names = ("identical", "events", "steps", "transfers", "first_difference", "faults")
    return {name: said[name] for name in names}


def _command(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    """The command, with its state in this folder."""
    command = [sys.executable, "-m", "firmware_runtime.cli", *words]
    environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(folder)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def _lines(report: Mapping[str, Any], speed_of: float) -> Iterator[str]:
    results = report["runs"]
    counted = Counter(kind for each in results for kind in each["done"])
    yield from (f"  {count} times {kind}" for kind, count in sorted(counted.items()))
    yield f"  {sum(each.get('steps', 0) for each in results)} steps run again"
    for each in results:
        if not each["identical"]:
            yield f"  seed {each['seed']}: {json.dumps(each)}"
    yield f"identical: {report['identical']} of {len(results)}"
    yield f"ratio {report['ratio']:.0f} (robot time by a replay's processor time, {speed_of:g} s)"
