"""A sweep's page: outcomes, histograms, each figure over each key, and the worst rows."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from firmware_runtime.lab.experiments.experiment_page import plot_figure
from firmware_runtime.lab.sweeps.row import EXPERIMENT
from firmware_runtime.lab.sweeps.summary import Case, Summary, rarer_truth
from firmware_runtime.lab.sweeps.sweep_table import Table
from firmware_runtime.view.markup import element, table
from firmware_runtime.view.report.report import page_of, section
from firmware_runtime.view.scatter import Scatter, histogram

MOST_DOTS: Final = 2000
"""Of one picture; of more rows every so many-th is drawn."""
MOST_SCATTERS: Final = 36


def sweep_page(rows: Table, found: Summary) -> str:
    """The page's text."""
    first = rows.rows[0]
    what = f", {first['experiment']}" if first.get("experiment") else ""
    title = f"{first['board']}{what}: sweep of {found.rows} runs"
    return page_of(title, _sections(title, rows, found))


def _sections(title: str, rows: Table, found: Summary) -> Iterator[Element]:
    opening = [f"{count} {name}" for name, count in found.outcomes.items()]
    opening += [
        f"{name} is true in {each.true} of {each.count} ({each.share:.1%})"
        for name, each in found.shares.items()
    ]
    items = [element("li", each) for each in opening]
    yield element("header", element("h1", title), element("ul", *items))
    yield section("What was varied", _varied(rows))
    yield section("Figures", _spreads(found), *_histograms(found))
    if scatters := list(_scatters(rows, found)):
        yield section("By key", element("div", *scatters, class_="pairs"))
    yield section("Worst", *(_cases(name, cases) for name, cases in found.worst.items()))


def _varied(rows: Table) -> Element:
    found = []
    for name in rows.varied:
        values = [each for each in rows.column(name) if each is not None]
        numbers = [each for each in values if isinstance(each, int | float)]
        ends = f"{min(numbers):.6g} to {max(numbers):.6g}" if len(numbers) == len(values) else ""
        found.append(
            (name, str(len(set(values))), ends or ", ".join(sorted(map(str, set(values)))))
        )
    return table("Keys of board.toml", ("key", "values", "from, to"), found)


def _spreads(found: Summary) -> Element:
    head = ("figure", "runs", "min", "5 %", "median", "mean", "95 %", "max")
    cells = [
        (name, str(each.count), *(f"{number:.4g}" for number in _numbers(each)))
        for name, each in found.spreads.items()
    ]
    return table("Spread over the runs", head, cells)


def _numbers(spread: object) -> list[float]:
    return [getattr(spread, name) for name in ("min", "p05", "median", "mean", "p95", "max")]


def _histograms(found: Summary) -> Iterator[Element]:
    for name, each in found.spreads.items():
        if len(each.histogram) > 1:
            yield plot_figure(histogram(name, each.histogram, each.min, each.max))


def _scatters(rows: Table, found: Summary) -> Iterator[Element]:
    """Each figure over each key with numbers, an experiment's figures first."""
    figures = sorted(
        (name for name, each in found.spreads.items() if each.min < each.max),
        key=lambda name: not name.startswith(EXPERIMENT),
    )
    drawn, rarer = 0, {name: rarer_truth(rows, name) for name in found.shares}
    for figure in figures:
        for key in rows.varied:
            points = _points(rows, key, figure, rarer)
            if len({point[0] for point in points}) > 1 and drawn < MOST_SCATTERS:
                drawn += 1
                caption = element("figcaption", f"{figure} over {key}")
                yield element("figure", caption, Scatter(key, figure, points).svg())


def _points(
    rows: Table, key: str, figure: str, rarer: Mapping[str, bool | None]
) -> list[tuple[float, float, bool]]:
    every = -(-len(rows.rows) // MOST_DOTS)
    found = []
    for row in rows.rows[::every]:
        across, up = row.get(key), row.get(figure)
        if _is_number(across) and _is_number(up):
            is_marked = any(row.get(name) is one for name, one in rarer.items() if one is not None)
            found.append((float(across), float(up), is_marked))  # type: ignore[arg-type]
    return found


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _cases(name: str, cases: Sequence[Case]) -> Element:
    body = [
        (str(each.row), str(each.value), each.why, element("code", each.command)) for each in cases
    ]
    return table(f"By {name}", ("row", "value", "why", "again"), body, "words")
