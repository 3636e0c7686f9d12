"""A sweep's page: outcomes, histograms, each figure over each key, and the worst rows."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, TypeAlias

from firmware_runtime.lab.sweeps.row import EXPERIMENT
from firmware_runtime.lab.sweeps.summary import (
    FIGURES,
    Case,
    Summary,
    number_of,
    rarer_truth,
    summary,
)
from firmware_runtime.lab.sweeps.sweep_table import Table
from firmware_runtime.view import parts
from firmware_runtime.view.notebook import show
from firmware_runtime.view.parts import (
    Beside,
    Bullets,
    Code,
    Histogram,
    Page,
    Series,
    curve,
    section,
    table,
)

Point: TypeAlias = tuple[float, float]
MOST_DOTS: Final = 2000
"""Most dots of one picture; of more rows every so many-th is drawn."""
MOST_SCATTERS: Final = 36


def sweep_page(rows: Table, found: Summary) -> Page:
    """The page of a sweep."""
    first = rows.rows[0]
    what = f", {first['experiment']}" if first.get("experiment") else ""
    scatters = list(_scatters(rows, found))
    return Page(
        title=f"{first['board']}{what}: sweep of {found.rows} runs",
        opening=[Bullets(items=list(_said(found)))],
        parts=[
            section("What was varied", _varied(rows)),
            section("Figures", _spreads(found), Beside(parts=list(_histograms(found)))),
            *([section("By key", Beside(parts=scatters))] if scatters else []),
            section("Worst", *(_cases(name, cases) for name, cases in found.worst.items())),
        ],
    )


def show_sweep(rows: Table) -> None:
    """Show the page in a notebook. Raises ConfigError where none runs this."""
    page = sweep_page(rows, summary(rows, "FILE"))
    show(page, "firmware-runtime sweep show FILE -o page.html")


def _said(found: Summary) -> Iterator[str]:
    for name, count in found.outcomes.items():
        yield f"{count} {name}"
    for name, each in found.shares.items():
        yield f"{name} is true in {each.true} of {each.count} ({each.share:.1%})"


def _varied(rows: Table) -> parts.Table:
    found = []
    for name in rows.varied:
        values = [each for each in rows.column(name) if each is not None]
        numbers = [each for each in values if isinstance(each, int | float)]
        is_of_numbers = numbers and len(numbers) == len(values)
        ends = f"{min(numbers):.6g} to {max(numbers):.6g}" if is_of_numbers else ""
        found.append(
            (name, str(len(set(values))), ends or ", ".join(sorted(map(str, set(values)))))
        )
    return table("Keys of board.toml", ("key", "values", "from, to"), found)


def _spreads(found: Summary) -> parts.Table:
    cells = [(name, str(each.count), *each.figures) for name, each in found.spreads.items()]
    return table("Spread over the runs", ("figure", "runs", *FIGURES), cells)


def _histograms(found: Summary) -> Iterator[Histogram]:
    """Yield one for each figure: its counts are in equal parts from the least to the greatest."""
    for name, each in found.spreads.items():
        if len(each.histogram) > 1:
            count = len(each.histogram)
            wide = each.max / count - each.min / count or abs(each.min) or 1.0
            edges = [each.min + number * wide for number in range(count + 1)]
            yield Histogram(
                title=name, across=name, edges=edges, counts=each.histogram, is_small=True
            )


def _scatters(rows: Table, found: Summary) -> Iterator[Series]:
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
                yield _scatter(key, figure, usual, rare)


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


def _scatter(key: str, figure: str, usual: list[Point], rare: list[Point]) -> Series:
    curves = [curve("runs", usual, "dots")]
    if rare:
        curves.append(curve("of the rarer truth", rare, "dots"))
    return Series(f"{figure} over {key}", key, figure, curves, is_small=True)


def _cases(name: str, cases: Sequence[Case]) -> parts.Table:
    body = [(str(each.row), str(each.value), each.why, Code(each.command)) for each in cases]
    return table(f"By {name}", ("row", "value", "why", "again"), body, is_words=True)
