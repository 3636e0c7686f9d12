"""The table of `top`: each model's lateness, lately and in the whole run. Needs the extra `top`."""

from collections.abc import Mapping
from typing import Final

from rich.table import Table
from rich.text import Text

from firmware_runtime.statistics.figures import ModelFigures
from firmware_runtime.statistics.number_formats import percent, rate, three_digits

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
