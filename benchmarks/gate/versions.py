"""Two checkouts to compare: TachoBot's package as it is, and with a longer step.

The longer one has a loop in front of the allocation, which works once in each control period. How
many turns it takes to make a period's processor time so much longer is measured, by the cheapest of
many stretches.
"""

import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from benchmarks.shared.side_by_side import PROJECT
from firmware_runtime.gate.checkouts import Checkout
from firmware_runtime.gate.side import Side

BOARD = "tachobot"
TRIAL_TURNS = 2000
SPAN_S = 1.0
STRETCHES = 60
_CHANGED = Path("boards", "tachobot", "allocation.py")
_LOOP = """

_plain = Allocation.external


def _longer(self, *arguments):
    for _ in range({turns}):
        pass
    return _plain(self, *arguments)


Allocation.external = _longer
"""


@dataclass(frozen=True, slots=True)
class Versions:
    """The same code twice, in two folders, and the code with the longer step."""

    base: Checkout
    same: Checkout
    longer: Checkout
    turns: int


def make_versions(into: Path, share: float) -> Versions:
    """Write them; the longer one takes so much more of a step. Raises ConfigError."""
    base, same = _copy(into / "base", 0), _copy(into / "same", 0)
    turns = _turns(base, _copy(into / "trial", TRIAL_TURNS), share)
    return Versions(base, same, _copy(into / "longer", turns), turns)


def _copy(folder: Path, turns: int) -> Checkout:
    """The packages that TachoBot's is of, with so many turns in front of the allocation."""
    ignore = shutil.ignore_patterns("__pycache__")
    for package in ("boards", "drivers", "sim_doubles", "firmware_runtime"):
        shutil.copytree(PROJECT / package, folder / package, ignore=ignore)
    if turns:
        with (folder / _CHANGED).open("a", encoding="utf-8") as file:
            file.write(_LOOP.format(turns=turns))
    return Checkout("HEAD" if turns else "BASE", folder.name, folder, None)


def _turns(base: Checkout, trial: Checkout, share: float) -> int:
    """As many as cost this share of a step."""
    cpu = min(os.sched_getaffinity(0))
    with Side(base, BOARD, []) as one, Side(trial, BOARD, []) as other:
        for side in (one, other):
            side.wait()
            side.stretch(cpu, 2 * SPAN_S)
        taken = [(one.stretch(cpu, SPAN_S), other.stretch(cpu, SPAN_S)) for _ in range(STRETCHES)]
    plain = min(pair[0].ns for pair in taken)
    trial_turns = min(pair[1].ns for pair in taken) - plain
    return round(share * plain / max(trial_turns, 1) * TRIAL_TURNS)
