"""Summary of a sweep: outcomes, the spread of each figure, and the worst rows by name."""

import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from math import fsum, isfinite
from statistics import fmean
from typing import Final

from msgspec import Struct

from firmware_runtime.board.assignments import set_words
from firmware_runtime.lab.quantile import quantile
from firmware_runtime.lab.sweeps.row import Cell, Row
from firmware_runtime.lab.sweeps.sweep_table import Table, sweep_of
from firmware_runtime.lab.sweeps.sweeping import SOUND
from firmware_runtime.statistics.run_text import aligned

WORST: Final = 5
BINS: Final = 20
FIGURES: Final = ("min", "5 %", "median", "mean", "95 %", "max")


class Spread(Struct, frozen=True):
    """The numbers of one column; ranks are those of sorted values, nothing is interpolated."""

    count: int
    min: float
    p05: float
    median: float
    mean: float
    p95: float
    max: float
    histogram: list[int]
    """Counts in each of `BINS` equal parts from min to max; one if all are equal."""

    @property
    def figures(self) -> list[str]:
        """Its numbers in words, in the order of `FIGURES`."""
        numbers = (self.min, self.p05, self.median, self.mean, self.p95, self.max)
        return [f"{each:.4g}" for each in numbers]


class Share(Struct, frozen=True):
    """Number of times that a column of truths was true."""

    count: int
    true: int

    @property
    def share(self) -> float:
        """From 0 to 1."""
        return self.true / self.count


class Case(Struct, frozen=True):
    """A row to look at, why, and the command that runs it again."""

    row: int
    value: Cell
    why: str
    command: str


class Summary(Struct, frozen=True):
    """All of it; figures by their column."""

    rows: int
    outcomes: dict[str, int]
    spreads: dict[str, Spread]
    shares: dict[str, Share]
    worst: dict[str, list[Case]]
    """By column; `outcome` has the rows that did not end in order."""


def summary(table: Table, name: str) -> Summary:
    """Summarise a table; `name` is the file's, for commands."""
    names = [*table.figures, *(each for each in table.columns if each == "duration_s")]
    numbers = {each: found for each in names if (found := _numbers(table, each))}
    truths = {each: said for each in names if (said := _truths(table, each))}
    return Summary(
        rows=len(table.rows),
        outcomes=dict(Counter(str(each) for each in table.column("outcome")).most_common()),
        spreads={each: spread(found) for each, found in numbers.items()},
        shares={each: Share(len(found), sum(found)) for each, found in truths.items()},
        worst=dict(_worst(table, name, list(numbers), list(truths))),
    )


def spread(values: Sequence[float]) -> Spread:
    """The spread of some numbers, one at least."""
    ranked = sorted(values)
    low, high = ranked[0], ranked[-1]
    return Spread(
        count=len(ranked),
        min=low,
        p05=quantile(ranked, 0.05) or 0.0,
        median=quantile(ranked, 0.5) or 0.0,
        mean=_mean(ranked),
        p95=quantile(ranked, 0.95) or 0.0,
        max=high,
        histogram=_histogram(ranked, low, high),
    )


def command_of(row: Row, file: str) -> str:
    """The command that runs a row again: `run` where that can say all of it, else `sweep rerun`."""
    sweep = sweep_of(row)
    if sweep.experiment is not None or sweep.for_s is None:
        return shlex.join(["firmware-runtime", "sweep", "rerun", file, str(row["row"])])
    words = ["firmware-runtime", "run", sweep.board, "--doubles", "--clock", "virtual"]
    words += ["--for", f"{sweep.for_s!r}", *set_words(sweep.assignments)]
    return shlex.join(words)


def number_of(cell: Cell) -> float | None:
    """A cell that is a number, as such."""
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        return float(cell)
    return None


def _numbers(table: Table, name: str) -> list[float]:
    """The cells of a column that has nothing but numbers."""
    cells = [each for each in table.column(name) if each is not None]
    numbers = [number for each in cells if (number := number_of(each)) is not None]
    return numbers if len(numbers) == len(cells) else []


def _truths(table: Table, name: str) -> list[bool]:
    """The cells of a column that has nothing but truths."""
    cells = [each for each in table.column(name) if each is not None]
    truths = [each for each in cells if isinstance(each, bool)]
    return truths if len(truths) == len(cells) else []


def rarer_truth(table: Table, name: str) -> bool | None:
    """Return the value that fewer rows have, false where both are as many; None if all have one.

    A name does not say whether true is good news, as of `settled`, or bad, as of `flooded`.
    """
    said = _truths(table, name)
    true = sum(said)
    return None if true in {0, len(said)} else true < len(said) - true


def _mean(values: Sequence[float]) -> float:
    try:
        return fmean(values)
    except OverflowError:  # of figures of runs that diverged, whose sum is beyond any float
        return fsum(each / len(values) for each in values)


def _histogram(values: Sequence[float], low: float, high: float) -> list[int]:
    if low == high:
        return [len(values)]
    counts = [0] * BINS
    scale = 1.0 if isfinite(high - low) else 0.5
    begin, span = low * scale, high * scale - low * scale
    for value in values:
        counts[min(int((value * scale - begin) / span * BINS), BINS - 1)] += 1
    return counts


def _worst(
    table: Table, file: str, numbers: Sequence[str], truths: Sequence[str]
) -> Iterator[tuple[str, list[Case]]]:
    """Rows that did not end in order; of truths the rarer ones; of numbers the largest."""
    failed = [row for row in table.rows if row["outcome"] not in SOUND]
    if failed:
        yield "outcome", [_case(table, row, "outcome", file) for row in failed[:WORST]]
    for name in truths:
        rarer = rarer_truth(table, name)
        cases = [row for row in table.rows if rarer is not None and row.get(name) is rarer]
        if cases:
            yield name, [_case(table, row, name, file) for row in cases[:WORST]]
    for name in numbers:
        if name == "duration_s":
            continue
        there = [row for row in table.rows if row.get(name) is not None]
        there.sort(key=lambda row: -abs(row[name]))  # type: ignore[arg-type]  # numbers, all
        yield name, [_case(table, row, name, file) for row in there[:WORST]]


def _case(table: Table, row: Row, name: str, file: str) -> Case:
    reasons = [row.get(each) for each in table.figures if each.endswith("_reason")]
    why = next((str(each) for each in (row.get("error"), *reasons) if each is not None), "")
    number = row["row"]
    assert isinstance(number, int)  # noqa: S101 -- a table is read so
    return Case(number, row[name], why, command_of(row, file))


_BARS: Final = " ▁▂▃▄▅▆▇█"


def text_of(found: Summary) -> Iterator[str]:
    """Its lines."""
    outcomes = ", ".join(f"{count} {name}" for name, count in found.outcomes.items())
    yield f"{found.rows} runs: {outcomes}"
    for name, share in found.shares.items():
        yield f"{name}: true in {share.true} of {share.count} ({share.share:.1%})"
    yield ""
    rows = [("figure", *FIGURES), *((name, *each.figures) for name, each in found.spreads.items())]
    bars = ["spread", *map(_bars, found.spreads.values())]  # which are not put to the right
    yield from (f"{line}  {bar}".rstrip() for line, bar in zip(aligned(rows), bars, strict=True))
    for name, cases in found.worst.items():
        yield ""
        yield _heading(name, cases[0])
        for case in cases:
            value = f"{case.value:.6g}" if isinstance(case.value, float) else case.value
            yield f"  row {case.row}: {value}{f', {case.why}' if case.why else ''}"
            yield f"    {case.command}"


def _heading(name: str, case: Case) -> str:
    """Head the rows below by what they have in common."""
    if name == "outcome":
        return "did not end in order:"
    if isinstance(case.value, bool):
        return f"{name} is {'true' if case.value else 'false'}:"
    return f"largest {name}:"


def _bars(spread: Spread) -> str:
    most = max(spread.histogram)
    return "".join(_BARS[-(-8 * count // most)] for count in spread.histogram)
