"""Which rows of a sweep `show` names: of a truth those in which it is what it rarely is."""

from typing import Any

import pytest

from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.lab.sweeps.summary import rarer_truth, summary, text_of
from firmware_runtime.lab.sweeps.sweep_table import Table

STATED: Row = {
    "board": "diver",
    "seed": 0,
    "experiment": None,
    "set": "[]",
    "outcome": "ended",
    "error": None,
    "for_s": 4.0,
    "duration_s": 4.0,
}


def table_of(*flooded: bool | None) -> Table:
    return Table(
        [{**STATED, "row": row, "result.flooded": each} for row, each in enumerate(flooded)]
    )


@pytest.mark.parametrize(
    ("flooded", "rarer"),
    [
        ((True, False, False), True),
        ((True, True, False, None), False),
        ((True, False), False),
        ((False, False), None),
        ((True, True), None),
        ((None, None), None),
    ],
)
def test_the_rarer_of_both_is_what_distinguishes_rows(flooded: Any, rarer: bool | None) -> None:  # noqa: ANN401, FBT001
    assert rarer_truth(table_of(*flooded), "result.flooded") is rarer


def test_rows_that_flooded_are_named_where_few_did() -> None:
    found = summary(table_of(False, True, False, False), "s.csv")
    assert [each.row for each in found.worst["result.flooded"]] == [1]
    assert "result.flooded is true:" in list(text_of(found))


def test_no_row_is_named_for_what_all_have_in_common() -> None:
    assert "result.flooded" not in summary(table_of(False, False), "s.csv").worst
