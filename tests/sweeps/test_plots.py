"""Pictures of a sweep keep their size on a wide page."""

import re

from firmware_runtime.lab.sweeps.summary import summary
from firmware_runtime.lab.sweeps.sweep_page import sweep_page
from firmware_runtime.lab.sweeps.sweep_table import Table
from firmware_runtime.view.scatter import WIDTH, Scatter
from tests.sweeps.test_rows_to_look_at import STATED


def test_a_figure_over_a_key_is_no_wider_than_half_a_page() -> None:
    style = Scatter("mass", "rise", [(0.0, 1.0, False), (1.0, 2.0, True)]).svg().attrib["style"]
    widest = float(style.removeprefix("max-width: ").removesuffix("px"))
    assert WIDTH <= widest < 1.5 * WIDTH


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
