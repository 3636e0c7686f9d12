"""Pictures of a sweep keep their size on a wide page."""

import re

from firmware_runtime.lab.sweeps.summary import summary
from firmware_runtime.lab.sweeps.sweep_page import sweep_page
from firmware_runtime.lab.sweeps.sweep_table import Table
from tests.sweeps.test_rows_to_look_at import STATED


def test_figures_over_keys_stand_side_by_side() -> None:
    rows = Table(
        [
            {**STATED, "row": row, "world.mass": 1.0 * row, "result.off": 2.0 * row}
            for row in range(3)
        ]
    )
    page = sweep_page(rows, summary(rows, "table.csv"))
    pair = r'<div class="pairs">\s*<figure>\s*<figcaption>result.off over world.mass'
    assert re.search(pair, page)


def test_runs_with_a_rare_truth_have_a_colour_of_their_own() -> None:
    rows = Table(
        [
            {**STATED, "row": row, "world.mass": 1.0 * row, "result.off": 2.0 * row}
            | {"result.flooded": row == 2}
            for row in range(4)
        ]
    )
    page = sweep_page(rows, summary(rows, "table.csv"))
    dots = [each.split() for each in re.findall(r'<circle class="([^"]*)"', page)]
    assert sorted(dots.count(each) for each in map(list, {tuple(each) for each in dots})) == [1, 3]
