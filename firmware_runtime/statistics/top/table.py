"""The table of `top`: each model's lateness, lately and in the whole run. Needs the extra `top`."""

from collections.abc import Mapping
from typing import Any, Final

from rich.table import Table
from rich.text import Text

from firmware_runtime.statistics.text.statistics import rate_text

_NARROW: Final = 78
"""Columns below which only what matters most is shown."""
_WIDE: Final = 100
"""Columns from which everything is shown."""
_NAME: Final = 21
"""Columns of a model's path; of a longer one the end is shown."""
_UNITS: Final = (("us", 1.0), ("ms", 1e3), ("s", 1e6))

_Models = Mapping[str, Mapping[str, Any]]


def models_table(run: _Models, lately: _Models, width: int, rows: int) -> Table:
    """Draw a row for a model, `rows` at most: those with a period, then those that were latest.

    `run` counts from the beginning, `lately` since the last reading; both by path, as in the JSON
    of `stats`.
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
        return run[path]["kind"] == "periodic", run[path]["lateness_us"]["max"] or 0.0

    room = rows if len(run) <= rows else max(rows - 1, 1)
    return set(sorted(run, key=importance, reverse=True)[:room])


def _cells(run: Mapping[str, Any], lately: Mapping[str, Any]) -> dict[str, str]:
    cells = {" rate": rate_text(run), "run skip": str(run["skipped"])}
    cells["run load"] = "-" if run["load"] is None else f"{run['load']:.1%}"
    for when, model in (("run", run), ("lately", lately)):
        cells[f"{when} late"] = str(model["overruns"])
        for name in ("p50", "p99", "max"):
            cells[f"{when} {name}"] = short(model["lateness_us"][name])
    return cells


def _end_of(path: str) -> str:
    """As many of the path's last names as there is room for, one at least."""
    end = path
    while len(end) > _NAME and "." in end:
        end = end.partition(".")[2]
    return end if end == path else f"\N{HORIZONTAL ELLIPSIS}{end}"


def short(us: float | None) -> str:
    """A time in three digits, `-` if there is none."""
    if us is None:
        return "-"
    unit, size = next((each for each in _UNITS if us < 999.5 * each[1]), _UNITS[-1])
    return f"{us / size:.3g} {unit}"
