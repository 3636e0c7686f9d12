"""Lateness over the time of a run, as a chart: mean and largest, what was late or skipped."""

from collections.abc import Callable, Sequence
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.page.plot import Plot
from firmware_runtime.statistics.page.scales import CountScale, LogScale, TimeScale
from firmware_runtime.statistics.page.stretch import Stretch, time_scale
from firmware_runtime.statistics.page.tables import chart, legend, table
from firmware_runtime.statistics.page.words import count, duration, instant, passed
from firmware_runtime.statistics.timeline import Span

_HEIGHT = 170
_ABOVE = 8
_LANE = 24
_LANES: tuple[tuple[str, Callable[[Span], int]], ...] = (
    ("late", lambda span: span.late),
    ("skipped", lambda span: span.skipped),
)
"""The strips under the plot, by class of the style sheet, with what they count."""


def lateness_over_time(run: Sequence[Stretch], tolerance_ns: int | None) -> Element | None:
    """Mean and largest lateness of every span, with what was late and what was skipped.

    None where nothing was ever late by any measure.
    """
    shown = [each for each in run if each.span.activations > 0 or each.span.skipped > 0]
    largest = max((each.span.lateness_max_ns for each in shown), default=0)
    if largest == 0:
        return None
    plot = _plot(run, shown, tolerance_ns)
    caption = "Lateness over time"
    svg = plot.svg("over-time", caption, _lateness_said(shown, largest))
    keys = legend(("tint", "largest"), ("mean", "mean"), ("late", "late"), ("skipped", "skipped"))
    return chart(svg, caption, keys, _lateness_table(shown))


def _plot(run: Sequence[Stretch], shown: Sequence[Stretch], tolerance_ns: int | None) -> Plot:
    plot = Plot(_HEIGHT, above=_ABOVE, below=2 * _LANE + 10)
    values = [ns for each in shown for ns in (each.mean, each.span.lateness_max_ns) if ns > 0]
    limits = [] if tolerance_ns is None else [tolerance_ns]
    across, up = time_scale(run), LogScale([*values, *limits])
    plot.axes(across, up)
    for each in shown:
        _lateness(plot, across, up, each)
    for limit in limits:
        down = plot.down(up.place(limit))
        plot.line((0, down), (1, down), "limit")
        plot.text(0, down - 5, f"tolerance {duration(limit)}", "limit-words")
    for row in range(len(_LANES)):
        _lane(plot, across, row, shown)
    return plot


def _lateness(plot: Plot, across: TimeScale, up: LogScale, each: Stretch) -> None:
    """One span: a column up to its largest lateness, a line at its mean."""
    begin, end = each.sides
    sides = across.place(begin), across.place(end)
    span = each.span
    if span.lateness_max_ns > 0:
        tooltip = (
            f"{instant(begin)} to {instant(end)}: largest {duration(span.lateness_max_ns)}, "
            f"mean {duration(each.mean)}, {span.late} late, {span.skipped} skipped"
        )
        top = plot.down(up.place(span.lateness_max_ns))
        plot.box(sides, (top, plot.bottom), "column tint", tooltip)
        if span.late > 0:
            plot.line((sides[0], top), (sides[1], top), "line cap late")
    if each.mean > 0:
        down = plot.down(up.place(each.mean))
        plot.line((sides[0], down), (sides[1], down), "line mean")


def _lane(plot: Plot, across: TimeScale, row: int, run: Sequence[Stretch]) -> None:
    """A strip under the plot with a mark where something was counted, the higher the more."""
    name, counted = _LANES[row]
    top = plot.bottom + 12 + row * _LANE
    base = top + _LANE - 4
    plot.box((0, 1), (top, base), "lane")
    plot.beside(top + _LANE / 2 - 2, name)
    up = CountScale(max((counted(each.span) for each in run), default=0))
    for each in run:
        if (number := counted(each.span)) > 0:
            begin, end = (across.place(at) for at in each.sides)
            mark = base - up.place(number) * (base - top)
            plot.box((begin, end), (mark, base), f"tick {name}", f"from {each.begin}: {number:,}")


def _lateness_said(run: Sequence[Stretch], largest: int) -> str:
    late = [each for each in run if each.span.late > 0]
    skipped = [each for each in run if each.span.skipped > 0]
    said = f"{count(len(run), 'span')} of time; the largest lateness is {duration(largest)}."
    if late:
        said += f" Late activations in {count(len(late), 'span')}, {_when(late)}."
    if skipped:
        said += f" Skipped ones in {count(len(skipped), 'span')}, {_when(skipped)}."
    return f"{said} The vertical axis is logarithmic."


def _when(run: Sequence[Stretch]) -> str:
    first, last = run[0], run[-1]
    if len(run) == 1:
        return f"from {first.begin} on"
    return f"the first from {first.begin}, the last from {last.begin}"


def _lateness_table(run: Sequence[Stretch]) -> Element:
    head = ["from", "for", "activations", "late", "skipped", "mean", "largest", "longest step"]
    return table(
        "Lateness by span",
        head,
        (
            [
                each.begin,
                passed(each.covered),
                f"{each.span.activations:,}",
                f"{each.span.late:,}",
                f"{each.span.skipped:,}",
                duration(each.mean),
                duration(each.span.lateness_max_ns),
                duration(each.span.step_max_ns),
            ]
            for each in run
        ),
    )
