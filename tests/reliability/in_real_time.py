"""What parts in real time say of a run that something befell: rows of a table, and its accounts."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from msgspec import Struct


class Judged(Struct, frozen=True, kw_only=True):
    """What became of a run: `well`, `ended` with a reason, or `wrong`."""

    board: str
    befell: str
    """What befell it."""
    outcome: str
    what: str
    """The reason, or what is wrong, with what makes it happen again."""


def rows_of(
    found: Sequence[Judged], befell: Sequence[str], boards: Sequence[str]
) -> Iterator[dict[str, object]]:
    """Yield how often each befell a robot, and what became of it."""
    for each, board in product(befell, boards):
        outcomes = [one.outcome for one in found if (one.befell, one.board) == (each, board)]
        counts = {name: outcomes.count(name) for name in ("well", "ended", "wrong")}
        yield {"befell": each, "board": board, "runs": len(outcomes), **counts}


def unaccounted(models: Mapping[str, Any]) -> Iterator[str]:
    """Yield the models of a run's statistics whose accounts do not hold."""
    for path, each in models.items():
        left = each["scheduled"] - each["run"] - each["skipped"] - each["coalesced"]
        if left not in {0, each["waiting"]}:
            yield f"{path} has {left} activations that nothing accounts for"
