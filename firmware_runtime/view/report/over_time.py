"""What a run did over time: lateness, what was late or skipped, and load.

The timeline is fine at its end and coarse before: a value holds from its span's begin to its end.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.history import Span
from firmware_runtime.statistics.number_formats import count, duration, instant, passed, share
from firmware_runtime.view.parts import Curve, Level, Number, Series, Table, table

_COUNTED: tuple[tuple[str, str, Callable[[Span], int]], ...] = (
    ("late", "doubtful", lambda span: span.late),
    ("skipped", "bad", lambda span: span.skipped),
)
"""What is counted in each span: its name, its colour, its number."""
_LEAST = 10
"""A span of which less than this part has passed says little about a load: it is left out."""

_Load: TypeAlias = tuple[str, Callable[[Span], int]]
_LOADS: tuple[_Load, ...] = (
    ("processor", lambda span: span.cpu_ns),
    ("buses together", lambda span: span.bus_ns),
)


class Stretch(NamedTuple):
    """A span of the timeline, as much of it as had passed when the file was read."""

    span: Span
    covered: int
    """ns."""

    @property
    def sides_s(self) -> tuple[float, float]:
        """Begin and end, in s of the run."""
        return self.span.begin_ns / SECOND, (self.span.begin_ns + self.covered) / SECOND

    @property
    def begin(self) -> str:
        """Begin, in words."""
        return instant(self.span.begin_ns)

    @property
    def mean(self) -> int:
        """The mean lateness of its activations, ns."""
        return self.span.lateness_ns // max(self.span.activations, 1)


def stretches(spans: Sequence[Span], elapsed: int) -> list[Stretch]:
    """The timeline up to the last instant that was written."""
    covered = ((span, min(span.width_ns, elapsed - span.begin_ns)) for span in spans)
    return [Stretch(span, passed) for span, passed in covered if passed > 0]


def lateness_over_time(run: Sequence[Stretch], tolerance_ns: int | None) -> Iterator[Series]:
    """Mean and largest lateness of every span, then what was late and skipped, if anything was.

    Nothing where nothing was ever late by any measure.
    """
    shown = [each for each in run if each.span.activations > 0 or each.span.skipped > 0]
    largest = max((each.span.lateness_max_ns for each in shown), default=0)
    if largest == 0:
        return
    ends = run[0].sides_s[0], run[-1].sides_s[1]
    limits = [] if tolerance_ns is None else [Level(tolerance_ns, "tolerance", is_limit=True)]
    yield Series(
        title="Lateness over time",
        across="s",
        up="ns",
        curves=[
            _held("largest", shown, lambda each: each.span.lateness_max_ns or None),
            _held("mean", shown, lambda each: each.mean or None),
        ],
        levels=limits,
        across_ends=ends,
        is_log=True,
        said=_lateness_said(shown, largest),
        numbers=[_lateness_table(shown)],
    )
    columns = [_columns(*each, shown) for each in _COUNTED]
    if any(any(each.y) for each in columns):
        yield Series(
            title="Late and skipped activations",
            across="s",
            up="activations",
            curves=sorted(columns, key=_total, reverse=True),  # the smaller ones in front
            across_ends=ends,
            said=_counted_said(shown),
        )


def _held(name: str, run: Sequence[Stretch], value: Callable[[Stretch], Number]) -> Curve:
    """A value of each stretch, which holds to its end; a gap where there is no stretch."""
    x: list[Number] = []
    y: list[Number] = []
    ended = None
    for each in run:
        begin, end = each.sides_s
        if ended is not None and ended < begin:
            x += ended, ended
            y += y[-1], None
        x.append(begin)
        y.append(value(each))
        ended = end
    if run:
        x.append(ended)
        y.append(y[-1])
    return Curve(name, x, y, "steps")


def _columns(
    name: str, colour: str, counted: Callable[[Span], int], run: Sequence[Stretch]
) -> Curve:
    begins = [each.sides_s[0] for each in run]
    return Curve(name, begins, [counted(each.span) for each in run], "columns", colour)


def _total(curve: Curve) -> float:
    return sum(number for _, number in curve.points)


def _lateness_said(run: Sequence[Stretch], largest: int) -> str:
    return (
        f"{count(len(run), 'span')} of time; the largest lateness is {duration(largest)}. "
        "The vertical axis is logarithmic."
    )


def _counted_said(run: Sequence[Stretch]) -> str:
    late = [each for each in run if each.span.late > 0]
    skipped = [each for each in run if each.span.skipped > 0]
    said = []
    if late:
        said.append(f"Late activations in {count(len(late), 'span')}, {_when(late)}.")
    if skipped:
        said.append(f"Skipped ones in {count(len(skipped), 'span')}, {_when(skipped)}.")
    return " ".join(said)


def _when(run: Sequence[Stretch]) -> str:
    first, last = run[0], run[-1]
    if len(run) == 1:
        return f"from {first.begin} on"
    return f"the first from {first.begin}, the last from {last.begin}"


def _lateness_table(run: Sequence[Stretch]) -> Table:
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


def load_over_time(run: Sequence[Stretch]) -> Series | None:
    """Show how busy the processor and the buses were; None where neither was counted."""
    run = [each for each in run if each.covered * _LEAST >= each.span.width_ns] or run
    loads = [load for load in _LOADS if any(load[1](each.span) > 0 for each in run)]
    if not loads:
        return None
    busiest = max(spent(each.span) / each.covered for _, spent in loads for each in run)
    return Series(
        title=f"Load over time: {' and '.join(name for name, _ in loads)}",
        across="s",
        up="%",
        curves=[_load_curve(load, run) for load in loads],
        across_ends=(run[0].sides_s[0], run[-1].sides_s[1]),
        up_ends=(0.0, 110.0 * busiest),
        said=f"The busiest span has {share(busiest)}.",
        numbers=[_load_table(run, loads)],
    )


def _load_curve(load: _Load, run: Sequence[Stretch]) -> Curve:
    name, spent = load
    return _held(name, run, lambda each: 100.0 * spent(each.span) / each.covered)


def _load_table(run: Sequence[Stretch], loads: Sequence[_Load]) -> Table:
    head = ["from", "for", "steps", *(name for name, _ in loads)]
    rows = (
        [
            *(each.begin, passed(each.covered), f"{each.span.steps:,}"),
            *(share(spent(each.span) / each.covered) for _, spent in loads),
        ]
        for each in run
    )
    return table("Load by span", head, rows)
