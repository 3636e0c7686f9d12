"""A sweep's page: outcomes, histograms, each figure over each key, and the worst rows."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, TypeAlias
from xml.etree.ElementTree import Element

from firmware_runtime.lab.sweeps.row import EXPERIMENT
from firmware_runtime.lab.sweeps.summary import FIGURES, Case, Summary, number_of, rarer_truth
from firmware_runtime.lab.sweeps.sweep_table import Table
from firmware_runtime.view.line_plot import (
    HALF_HEIGHT,
    HALF_WIDTH,
    Curve,
    LinePlot,
    figure_of,
    histogram,
)
from firmware_runtime.view.markup import (
    bullets,
    element,
    opening,
    page_of,
    section,
    side_by_side,
    table,
)

Point: TypeAlias = tuple[float, float]
MOST_DOTS: Final = 2000
"""Most dots of one picture; of more rows every so many-th is drawn."""
MOST_SCATTERS: Final = 36


def sweep_page(rows: Table, found: Summary) -> str:
    """The page's text."""
    first = rows.rows[0]
    what = f", {first['experiment']}" if first.get("experiment") else ""
    title = f"{first['board']}{what}: sweep of {found.rows} runs"
    return page_of(title, _sections(title, rows, found))


def _sections(title: str, rows: Table, found: Summary) -> Iterator[Element]:
    said = [f"{count} {name}" for name, count in found.outcomes.items()]
    said += [
        f"{name} is true in {each.true} of {each.count} ({each.share:.1%})"
        for name, each in found.shares.items()
    ]
    yield opening(title, bullets(said))
    yield section("What was varied", _varied(rows))
    yield section("Figures", _spreads(found), *_histograms(found))
    if scatters := list(_scatters(rows, found)):
        yield section("By key", side_by_side(scatters))
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
    cells = [(name, str(each.count), *each.figures) for name, each in found.spreads.items()]
    return table("Spread over the runs", ("figure", "runs", *FIGURES), cells)


def _histograms(found: Summary) -> Iterator[Element]:
    for name, each in found.spreads.items():
        if len(each.histogram) > 1:
            yield figure_of(histogram(name, each.histogram, each.min, each.max))


def _scatters(rows: Table, found: Summary) -> Iterator[Element]:
    """Each figure over each key with numbers, an experiment's figures first."""
    figures = sorted(
        (name for name, each in found.spreads.items() if each.min < each.max),
        key=lambda name: not name.startswith(EXPERIMENT),
    )
    drawn, rarer = 0, {name: rarer_truth(rows, name) for name in found.shares}
    for figure in figures:
        for key in rows.varied:
            usual, rare = _points(rows, key, figure, rarer)
            if len({at for at, _ in usual + rare}) > 1 and drawn < MOST_SCATTERS:
                drawn += 1
                yield figure_of(_scatter(key, figure, usual, rare))


def _points(
    rows: Table, key: str, figure: str, rarer: Mapping[str, bool | None]
) -> tuple[list[Point], list[Point]]:
    """Figure over key, of usual runs, and of those with a truth that is rarely so."""
    every = -(-len(rows.rows) // MOST_DOTS)
    usual: list[Point] = []
    rare: list[Point] = []
    for row in rows.rows[::every]:
        across, up = (number_of(row.get(name)) for name in (key, figure))
        if across is not None and up is not None:
            is_rare = any(row.get(name) is one for name, one in rarer.items() if one is not None)
            (rare if is_rare else usual).append((across, up))
    return usual, rare


def _scatter(key: str, figure: str, usual: list[Point], rare: list[Point]) -> LinePlot:
    curves = [Curve("runs", usual, is_dots=True)]
    if rare:
        curves.append(Curve("of the rarer truth", rare, is_dots=True))
    title = f"{figure} over {key}"
    return LinePlot(title, key, figure, curves, width=HALF_WIDTH, height=HALF_HEIGHT)


def _cases(name: str, cases: Sequence[Case]) -> Element:
    body = [
        (str(each.row), str(each.value), each.why, element("code", each.command)) for each in cases
    ]
    return table(f"By {name}", ("row", "value", "why", "again"), body, "words")
