"""Parts in real time: what befalls runs, what becomes of each, and the result that says so."""

import argparse
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from msgspec import Struct, convert

from firmware_runtime.statistics.figures import ModelFigures
from tests.reliability.results import Result


class Trial(Struct, frozen=True, kw_only=True):
    """One run, and what befalls it."""

    board: str
    befalls: str


class Judged(Struct, frozen=True, kw_only=True):
    """What became of a run: `well`, `ended` with a reason, or `wrong`."""

    trial: Trial
    outcome: str
    what: str
    """The reason, or what is wrong."""


def add_trials(parser: argparse.ArgumentParser, count: int) -> None:
    """Add the options of a part that makes so many trials unless told otherwise."""
    parser.add_argument("--trials", type=int, default=count, help=f"in all; default {count}")
    parser.add_argument("--minutes", type=float, help="begin no other after so long")
    parser.add_argument("--seed", type=int, default=1)


def goes_on(run: "subprocess.Popen[str]", for_s: float) -> bool:
    """Wait for so long; return whether the run is still under way."""
    try:
        run.wait(for_s)
    except subprocess.TimeoutExpired:
        return True
    return False


def unaccounted(models: Mapping[str, Any]) -> Iterator[str]:
    """Yield the models of a run's statistics whose accounts do not hold."""
    for path, each in convert(models, dict[str, ModelFigures]).items():
        if not each.is_accounted_for:
            yield f"{path} has {each.outstanding} activations that nothing accounts for"


def result_of(
    name: str, of: str, found: Sequence[Judged], befalls: Sequence[str], boards: Sequence[str]
) -> Result:
    """Say what is wrong, and return the result of a part: runs `of` what befell them."""
    wrong = [f"{each.trial}: {each.what}" for each in found if each.outcome == "wrong"]
    for each in wrong:
        sys.stdout.write(f"{each}\n")
    return Result(
        name=name,
        summary=f"{len(found)} runs {of}, {len(wrong)} wrong",
        is_sound=not wrong and len(found) > 0,
        figures={"rows": list(_rows(found, befalls, boards)), "wrong": wrong},
    )


def _rows(
    found: Sequence[Judged], befalls: Sequence[str], boards: Sequence[str]
) -> Iterator[dict[str, object]]:
    for each, board in product(befalls, boards):
        outcomes = [
            one.outcome for one in found if (one.trial.befalls, one.trial.board) == (each, board)
        ]
        counts = {name: outcomes.count(name) for name in ("well", "ended", "wrong")}
        yield {"befell": each, "board": board, "runs": len(outcomes), **counts}
