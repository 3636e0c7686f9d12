"""How busy the processor and the buses were over the time of a run, as a chart."""

from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.page.plot import Plot
from firmware_runtime.statistics.page.scales import ShareScale
from firmware_runtime.statistics.page.stretch import Stretch, time_scale
from firmware_runtime.statistics.page.tables import chart, legend, table
from firmware_runtime.statistics.page.words import passed, share
from firmware_runtime.statistics.timeline import Span

_HEIGHT = 120
_LEAST = 10
"""A span of which less than this part has passed says little about a load: it is left out."""

_Load: TypeAlias = tuple[str, str, Callable[[Span], int]]
_LOADS: tuple[_Load, ...] = (
    ("blue", "processor", lambda span: span.cpu_ns),
    ("bus", "buses together", lambda span: span.bus_ns),
)


def load_over_time(run: Sequence[Stretch]) -> Element | None:
    """How busy the processor and the buses were; None where neither was counted."""
    run = [each for each in run if each.covered * _LEAST >= each.span.width_ns] or run
    loads = [load for load in _LOADS if any(load[2](each.span) > 0 for each in run)]
    if not loads:
        return None
    plot = Plot(_HEIGHT, above=8)
    busiest = max(load[2](each.span) / each.covered for load in loads for each in run)
    across, up = time_scale(run), ShareScale(busiest)
    plot.axes(across, up)
    for css, _, spent in loads:
        for each in run:
            begin, end = (across.place(at) for at in each.sides)
            down = plot.down(up.place(spent(each.span) / each.covered))
            plot.line((begin, down), (end, down), f"line {css}")
    names = " and ".join(words for _, words, _ in loads)
    caption = f"Load over time: {names}"
    svg = plot.svg("load", caption, f"The busiest span has {share(busiest)}.")
    keys = legend(*((css, words) for css, words, _ in loads))
    return chart(svg, caption, keys, _load_table(run, loads))


def _load_table(run: Sequence[Stretch], loads: Sequence[_Load]) -> Element:
    head = ["from", "for", "steps", *(words for _, words, _ in loads)]
    return table("Load by span", head, _load_rows(run, loads))


def _load_rows(run: Sequence[Stretch], loads: Sequence[_Load]) -> Iterator[list[str]]:
    for each in run:
        shares = [share(spent(each.span) / each.covered) for _, _, spent in loads]
        yield [each.begin, passed(each.covered), f"{each.span.steps:,}", *shares]
