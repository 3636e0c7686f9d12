"""Which rows of a sweep `show` names: of a truth those in which it is what it rarely is."""

from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.lab.sweeps.summary import rarer_truth, summary, text_of
from firmware_runtime.lab.sweeps.sweep_page import sweep_page
from firmware_runtime.lab.sweeps.sweep_table import Table, read_table

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


@pytest.mark.parametrize(
    ("figures", "spread_of"),
    [
        (["1e308", "-1e308", "0"], (-1e308, 0.0, 1e308)),
        (["1.5e308", "1.5e308", "1.7e308"], (1.5e308, 1.5666666666666668e308, 1.7e308)),
        (["5e-324", "0", "0"], (0.0, 0.0, 5e-324)),
        (["9" * 400, "1", "2"], None),
        (["NaN", "1", "2"], None),
        (["1", "-Infinity", "2"], None),
        (["1", "1e400", "2"], None),
    ],
)
def test_a_table_of_runs_that_diverged_is_summed_up_as_far_as_it_can_be(
    tmp_path: Path, figures: list[str], spread_of: tuple[float, ...] | None
) -> None:
    path = tmp_path / "x.csv"
    lines = [f"{row},tachobot,0,,ended,1.0,{each}" for row, each in enumerate(figures)]
    header = "row,board,seed,controller.yaw.kp,outcome,for_s,result.yaw_rad"
    path.write_text("\n".join((header, *lines)))
    table = read_table(path)
    found = summary(table, "x.csv")
    assert next(iter(text_of(found))) == "3 runs: 3 ended"
    spread = found.spreads.get("result.yaw_rad")
    assert (spread and (spread.min, spread.mean, spread.max)) == spread_of
    sweep_page(table, found)
