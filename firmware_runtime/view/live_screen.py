"""Screen of `top`: a reading of the statistics, drawn to fit a terminal. Needs the extra `top`."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Final

from rich.console import ConsoleDimensions, Group, RenderableType
from rich.table import Table
from rich.text import Text

from firmware_runtime.statistics.figures import Figures, ModelFigures
from firmware_runtime.statistics.histogram import Histogram, bucket_of
from firmware_runtime.statistics.number_formats import (
    microseconds,
    percent,
    rate,
    seconds,
    three_digits,
)
from firmware_runtime.statistics.run_text import because, causes_text, deadline_text, link_text
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.statistics.summary import fault_lines, summary

_NARROW: Final = 78
"""Columns below which only what matters most is shown."""
_WIDE: Final = 100
"""Columns from which everything is shown."""
_NAME: Final = 21
"""Columns of a model's path; of a longer one the end is shown."""

_Models = Mapping[str, ModelFigures]


def models_table(run: _Models, lately: _Models, width: int, rows: int) -> Table:
    """Draw a row for a model, `rows` at most: those with a period, then those that were latest.

    `run` counts from the beginning, `lately` since the last reading; both by path.
    """
    columns = _columns(width)
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style="dim")
    table.add_column("\nlateness", no_wrap=True)
    for label in columns:
        table.add_column(label.replace(" ", "\n"), justify="right", no_wrap=True)
    shown = _most_important(run, rows)
    for path in (path for path in run if path in shown):
        cells = _cells(run[path], lately[path])
        table.add_row(_end_of(path), *(cells[label] for label in columns))
    if left_out := len(run) - len(shown):
        table.add_row(Text(f"{left_out} more: stats", style="dim"))
    return table


def _columns(width: int) -> list[str]:
    """Labels of two words, one above the other."""
    if width < _NARROW:
        return ["lately p99", "run p99", "run max", "run late"]
    lately = ["lately p99", "lately max", "lately late"]
    run = ["run p99", "run max", "run late", "run skip"]
    if width < _WIDE:
        return [" rate", *lately, *run]
    return [" rate", "lately p50", *lately, "run p50", *run, "run load"]


def _most_important(run: _Models, rows: int) -> set[str]:
    def importance(path: str) -> tuple[bool, float]:
        return run[path].kind == "periodic", run[path].lateness_us.max or 0.0

    room = rows if len(run) <= rows else max(rows - 1, 1)
    return set(sorted(run, key=importance, reverse=True)[:room])


def _cells(run: ModelFigures, lately: ModelFigures) -> dict[str, str]:
    cells = {" rate": rate(run.period_us), "run skip": str(run.skipped)}
    cells["run load"] = percent(run.load)
    for when, model in (("run", run), ("lately", lately)):
        late = model.lateness_us
        cells[f"{when} late"] = str(model.overruns)
        for name, us in (("p50", late.p50), ("p99", late.p99), ("max", late.max)):
            cells[f"{when} {name}"] = three_digits(us)
    return cells


def _end_of(path: str) -> str:
    """As many of the path's last names as there is room for, one at least."""
    end = path
    while len(end) > _NAME and "." in end:
        end = end.partition(".")[2]
    return end if end == path else f"\N{HORIZONTAL ELLIPSIS}{end}"


_SPARKS = "▁▂▃▄▅▆▇█"
_BAR = "█"
_WORST = 4
_FAULTS = 4
"""Kinds of faults shown, those that came last."""
_OTHER_ROWS = 15
"""Rows above and below the histogram, each model's row aside, in a terminal of 80 columns."""
_FEWEST_BARS = 4


def screen(
    now: Statistics, lately: Statistics, size: ConsoleDimensions, *, paused: bool
) -> RenderableType:
    """The whole picture; `lately` is what came since the last one."""
    return Group(*_parts(now, lately, now.figures(), size, paused=paused))


def _parts(
    now: Statistics,
    lately: Statistics,
    figures: Figures,
    size: ConsoleDimensions,
    *,
    paused: bool,
) -> Iterable[RenderableType]:
    shown = min(len(list(fault_lines(figures))), _FAULTS)
    width, first = size.width, summary(figures)
    room = size.height - _OTHER_ROWS - shown - (len(first) - 1) // width
    rows = max(min(len(figures.models), room - _FEWEST_BARS), 1)
    yield Text(first, style=_style(figures))
    yield _facts(figures)
    if figures.models:
        yield Text()
        yield models_table(figures.models, lately.figures().models, width, rows)
        yield Text()
        yield _histogram(now, lately, width, max(room - rows, _FEWEST_BARS))
        yield _sparkline(now, width)
    yield Text()
    if figures.link is not None:
        style = "green" if figures.link.is_good else "bold yellow"
        text = f"link: {link_text(figures.link)}"
        yield Text(text, style=style, overflow="ellipsis", no_wrap=True)
    yield from _faults(figures)
    yield from _worst(figures)
    yield Text()
    keys = "q quit  space go on" if paused else "q quit  space pause"
    yield Text(f"{keys}  {'paused' if paused else ''}", style="dim")


def _style(figures: Figures) -> str:
    """Red when something is wrong, green while all is well."""
    if figures.conditions.run.state in {"died", "failed", "overrun"}:
        return "bold red"
    wrong = figures.overruns + figures.skipped + figures.faults_total
    return "bold green" if wrong == 0 else "bold yellow"


def _facts(figures: Figures) -> Text:
    """Say where, how long, and how often lines failed."""
    run = figures.conditions.run
    cpu = percent(None if run.cpu_s is None else run.cpu_s / max(run.elapsed_s, 1e-9))
    errors = {name: bus.errors for name, bus in figures.bus.items()}
    errors |= {name: port.errors for name, port in (figures.serial or {}).items()}
    parts = [
        figures.conditions.text("board") or "",
        f"{run.elapsed_s:.0f} s",
        f"cpu {cpu}",
        *(f"{name} {count} errors" for name, count in errors.items()),
        *(f"{name}: {deadline_text(counted)}" for name, counted in figures.deadlines.items()),
    ]
    return Text("  ".join(parts), style="dim", overflow="ellipsis", no_wrap=True)


def _histogram(now: Statistics, lately: Statistics, width: int, bars: int) -> Table:
    """Lateness in powers of two: bars for what came lately, numbers for the whole run.

    Where the terminal is too low for all of them, a bar stands for several.
    """
    whole, new = _octaves(now.lateness()), _octaves(lately.lateness())
    used = [index for index, count in enumerate(whole) if count > 0]
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(justify="right", style="dim", no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(justify="right", no_wrap=True)
    if not used:
        return table
    each = -(-(used[-1] + 1 - used[0]) // bars)
    starts = range(used[0], used[-1] + 1, each)
    counts = [sum(new[start : start + each]) for start in starts]
    most, length = max(*counts, 1), max(width - 32, 8)
    for start, count in zip(starts, counts, strict=True):
        bar = _BAR * -(-count * length // most)
        edge = f"< {microseconds(2 ** (start + each - 1) / 1000)}"
        table.add_row(edge, bar.ljust(length), f"{sum(whole[start : start + each])}")
    return table


def _octaves(histogram: Histogram) -> list[int]:
    """Count samples below each power of two ns, and not below the one before."""
    buckets = histogram.buckets.tolist()
    edges = [0, *(bucket_of((1 << power) - 1) + 1 for power in range(1, 38))]
    return [0, *(sum(buckets[a:b]) for a, b in pairwise(edges))]


def _sparkline(now: Statistics, width: int) -> Text:
    """The largest lateness of each second of the last minutes."""
    spans = now.timeline[-max(width - 24, 8) :]
    largest = max((span.lateness_max_ns for span in spans), default=0)
    return Text(
        f"max a second {_sparks([span.lateness_max_ns for span in spans], largest)} "
        f"{microseconds(largest / 1000)}",
        style="cyan",
        overflow="crop",
        no_wrap=True,
    )


def _sparks(values: Sequence[int], largest: int) -> str:
    return "".join(_SPARKS[value * (len(_SPARKS) - 1) // max(largest, 1)] for value in values)


def _faults(figures: Figures) -> Iterable[Text]:
    for line in list(fault_lines(figures))[-_FAULTS:]:
        yield Text(f"fault: {line}", style="yellow", overflow="ellipsis", no_wrap=True)


def _worst(figures: Figures) -> Iterable[Text]:
    for worst in figures.worst[:_WORST]:
        yield Text(
            f"{seconds(worst.t_ns / 1e9):>11}  {worst.model} {microseconds(worst.lateness_us)}"
            f" late, step {microseconds(worst.step_us)}: {causes_text(worst.causes)}"
            f"{because(worst)}",
            overflow="ellipsis",
            no_wrap=True,
        )
