"""Measures two engines on the same work: one run of each in turn, every run in a fresh process.

An engine is a module that takes the work's arguments, does it once and prints a JSON object:
`seconds`, CPU time by part (building the model, building the simulator for it, running it), and
`counts`, which say what was done. Taking turns spreads whatever else the machine does over both;
medians drop the worst of it.
"""

import argparse
import json
import os
import platform
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median

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


def run_once(module: str, *arguments: object) -> Sample:
    """Run one engine once, in a process of its own."""
    command = [sys.executable, "-m", module, *map(str, arguments)]
    done = subprocess.run(command, cwd=PROJECT, check=True, stdout=subprocess.PIPE, text=True)
    answer = json.loads(done.stdout)
    return Sample(answer["seconds"], answer["counts"])


def in_turns(modules: Sequence[str], repetitions: int, *arguments: object) -> list[list[Sample]]:
    """The samples of each engine."""
    rounds = [[run_once(module, *arguments) for module in modules] for _ in range(repetitions)]
    return [list(samples) for samples in zip(*rounds, strict=True)]


def check_counts(who: str, sample: Sample, expected: Mapping[str, int]) -> None:
    """Refuse a sample whose counts are not the expected ones."""
    if dict(sample.counts) != dict(expected):
        raise WrongCountError(f"{who} counted {dict(sample.counts)}, expected {dict(expected)}")


def medians(samples: Sequence[Sample]) -> dict[str, float]:
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


def conditions() -> dict[str, object]:
    """What the figures were measured on."""
    return {
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "machine": platform.machine(),
        "system": f"{platform.system()} {platform.release()}",
        "cpu": _cpu_name(),
        "cpus": os.cpu_count(),
        "load": round(os.getloadavg()[0], 2),
        PEER: peer_version(),
    }


def conditions_text(found: Mapping[str, object]) -> str:
    """The conditions in one line."""
    line = "{python} on {system} {machine}, {cpu}, {cpus} CPUs, load {load}".format(**found)
    return f"{line}; {PEER} {found[PEER]}"


def positive(text: str) -> int:
    """A command line's whole number from 1 on."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}: expected 1 or more")
    return value


def _cpu_name() -> str:
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"
