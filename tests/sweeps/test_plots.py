"""Figures of a sweep: each over each key, and in bars."""

from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.lab.sweeps.summary import summary
from firmware_runtime.lab.sweeps.sweep_page import sweep_page
from firmware_runtime.lab.sweeps.sweep_table import Table
from firmware_runtime.view.parts import Beside, Histogram, Page, Section, Series
from tests.sweeps.test_rows_to_look_at import STATED


def page_of(*more: Row) -> Page:
    """The page of a sweep whose figure is twice its key."""
    rows: list[Row] = [
        {**STATED, "row": row, "world.mass": 1.0 * row, "result.off": 2.0 * row, **each}
        for row, each in enumerate(more)
    ]
    return sweep_page(Table(rows), summary(Table(rows), "table.csv"))


def beside(page: Page, title: str) -> list[object]:
    (section,) = (e for e in page.parts if isinstance(e, Section) and e.title == title)
    return [each for part in section.parts if isinstance(part, Beside) for each in part.parts]


def test_figures_over_keys_stand_side_by_side() -> None:
    plots = beside(page_of({}, {}, {}), "By key")
    (plot,) = (e for e in plots if isinstance(e, Series) and e.across == "world.mass")
    assert (plot.title, plot.up) == ("result.off over world.mass", "result.off")
    assert plot.curves[0].points == [(0.0, 0.0), (1.0, 2.0), (2.0, 4.0)]


def test_every_run_is_in_a_bar_of_each_figure() -> None:
    for each in beside(page_of({}, {}, {}), "Figures"):
        assert isinstance(each, Histogram)
        assert (each.edges[0], sum(each.counts)) == (0.0, 3)
        assert len(each.edges) == len(each.counts) + 1


def test_runs_with_a_rare_truth_are_a_curve_of_their_own() -> None:
    rows: list[Row] = [{"result.flooded": row == 2} for row in range(4)]
    page = page_of(*rows)
    (plot,) = (e for e in beside(page, "By key") if isinstance(e, Series))
    assert [len(curve.x) for curve in plot.curves] == [3, 1]
    assert {curve.style for curve in plot.curves} == {"dots"}
