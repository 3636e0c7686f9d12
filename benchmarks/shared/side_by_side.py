"""Measures two engines on the same work: one run of each in turn, every run in a fresh process.

An engine is a module that takes the work's arguments, does it once and prints a JSON object:
`seconds`, CPU time by part (building the model, building the simulator for it, running it), and
`counts`, which say what was done. Taking turns spreads whatever else the machine does over both;
medians drop the worst of it.
"""

import json
import shlex
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any, TypeVar

M = TypeVar("M")
S = TypeVar("S")
T = TypeVar("T")

PROJECT = Path(__file__).parents[2]
OURS = "firmware-runtime"
PEER = "xdevs.py"
PARTS = ("model", "simulator", "run")


@dataclass(frozen=True, slots=True)
class Sample:
    """One run: CPU seconds by part, and what the engine counted (absent if it did not count)."""

    seconds: Mapping[str, float]
    counts: Mapping[str, int] = field(default_factory=dict)

    @property
    def total(self) -> float:
        """CPU seconds of all parts, set-up included."""
        return sum(self.seconds.values())


class WrongCountError(Exception):
    """An engine did another amount of work than the model demands."""


def print_sample(
    model_of: Callable[[], M],
    simulator_of: Callable[[M], S],
    run: Callable[[S], object],
    counts: Callable[[M, S], Mapping[str, int]],
) -> None:
    """Build, run and count; print what each part took: an engine's side of `run_once`."""
    begun = process_time()
    model = model_of()
    modelled = process_time()
    simulator = simulator_of(model)
    prepared = process_time()
    run(simulator)
    spans = modelled - begun, prepared - modelled, process_time() - prepared
    seconds = dict(zip(PARTS, spans, strict=True))
    print(json.dumps({"seconds": seconds, "counts": counts(model, simulator)}))


def answer_of(module: str, *arguments: object) -> dict[str, Any]:
    """Run a module in a process of its own; return the JSON of the last line that it prints."""
    command = [sys.executable, "-m", module, *map(str, arguments)]
    done = subprocess.run(command, cwd=PROJECT, check=True, stdout=subprocess.PIPE, text=True)
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def run_once(module: str, *arguments: object) -> Sample:
    """Run one engine once, in a process of its own."""
    return Sample(**answer_of(module, *arguments))


def in_turns(modules: Sequence[str], repetitions: int, *arguments: object) -> list[list[Sample]]:
    """The samples of each engine."""
    rounds = [[run_once(module, *arguments) for module in modules] for _ in range(repetitions)]
    return [list(samples) for samples in zip(*rounds, strict=True)]


def turned(names: Sequence[T], number: int) -> list[T]:
    """The names from another one on in each round: each is first equally often."""
    first = number % len(names)
    return [*names[first:], *names[:first]]


def check_counts(who: str, sample: Sample, expected: Mapping[str, int]) -> None:
    """Refuse a sample whose counts are not the expected ones."""
    if dict(sample.counts) != dict(expected):
        raise WrongCountError(f"{who} counted {dict(sample.counts)}, expected {dict(expected)}")


def compared(ours: Sequence[Sample], peers: Sequence[Sample]) -> dict[str, Any]:
    """The medians of both engines by part, in CPU seconds, and the peer's by ours."""
    seconds = {OURS: _medians(ours), PEER: _medians(peers)}
    ratios = {part: seconds[PEER][part] / seconds[OURS][part] for part in ("run", "total")}
    return {"seconds": seconds, "run_ratio": ratios["run"], "ratio": ratios["total"]}


def _medians(samples: Sequence[Sample]) -> dict[str, float]:
    """The median of each part and of the total, in CPU seconds."""
    by_part = {part: median(sample.seconds[part] for sample in samples) for part in PARTS}
    return {**by_part, "total": median(sample.total for sample in samples)}


def peer_version() -> str | None:
    """The version of the peer that is installed, None if there is none."""
    try:
        return version("xdevs")
    except PackageNotFoundError:
        return None


def missing_peer() -> str:
    """What to do when the peer is not there; a venv's own pip may not know groups yet."""
    pip = f"{shlex.quote(sys.executable)} -m pip install"
    return (
        "benchmarks: xdevs.py is not installed; "
        f"expected the dependency group bench: {pip} 'pip>=25.1' && {pip} --group bench"
    )
