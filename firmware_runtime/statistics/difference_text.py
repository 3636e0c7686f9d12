"""Two runs side by side: what they were run under, then every figure of both, with its ratio."""

from collections.abc import Iterator
from typing import Any

from msgspec import Struct, to_builtins
from msgspec.structs import asdict

from firmware_runtime.statistics.comparison import differing_conditions
from firmware_runtime.statistics.figures import Activations, Figures
from firmware_runtime.statistics.number_formats import NOT_KNOWN
from firmware_runtime.statistics.statistics import Statistics


class Pair(Struct, frozen=True):
    """A condition of both runs."""

    a: Any
    b: Any


class Compared(Struct, frozen=True):
    """A figure of both runs; `ratio` is b / a, None where that is not defined."""

    a: float | None
    b: float | None
    ratio: float | None


class Difference(Struct, frozen=True):
    """Difference of two runs, by the figure's name; of the conditions only those that differ."""

    conditions: dict[str, Pair]
    figures: dict[str, Compared]

    def as_json(self) -> dict[str, object]:
        """As `stats --diff A B --json` prints it."""
        printed: dict[str, object] = to_builtins(self)
        return printed


def difference_of(first: Statistics, second: Statistics) -> Difference:
    """Both runs' figures."""
    figures = [dict(_figures(run.figures())) for run in (first, second)]
    conditions = differing_conditions([first, second])
    return Difference(
        {name: Pair(*values) for name, values in conditions.items()},
        {
            name: _compared(*(each.get(name) for each in figures))
            for name in dict.fromkeys([*figures[0], *figures[1]])
        },
    )


def difference_text(difference: Difference) -> Iterator[str]:
    """The difference in lines."""
    if difference.conditions:
        yield "not under the same conditions, so the figures do not compare as they are:"
        for name, values in difference.conditions.items():
            yield f"  {name}: {values.a} | {values.b}"
    else:
        yield "under the same conditions"
    yield ""
    width = max(map(len, difference.figures), default=0)
    yield f"  {'':{width}} {'a':>14} {'b':>14} {'b / a':>8}"
    for name, each in difference.figures.items():
        ratio = NOT_KNOWN if each.ratio is None else f"{each.ratio:.3f}"
        yield f"  {name:{width}} {_number(each.a):>14} {_number(each.b):>14} {ratio:>8}"


def _figures(figures: Figures) -> Iterator[tuple[str, float | None]]:
    yield "elapsed_s", figures.conditions.run.elapsed_s
    yield "on_time", figures.on_time
    for name in Activations.__struct_fields__:
        yield name, getattr(figures, name)
    for kind, times in (("lateness_us", figures.lateness_us), ("step_us", figures.step_us)):
        for name, us in asdict(times).items():
            yield f"{kind}.{name}", us
    for path, missed in figures.deadline_misses.items():
        yield f"deadline_misses.{path}", missed
    yield "faults", figures.faults_total
    for path, kinds in figures.faults.items():
        for kind, fault in kinds.items():
            yield f"faults.{path}.{kind}", fault.count
    for name, bus in figures.bus.items():
        yield f"bus.{name}.errors", bus.errors
        yield f"bus.{name}.retries", bus.retries
        yield f"bus.{name}.utilisation", bus.utilisation
    for name, port in (figures.serial or {}).items():
        for figure, value in asdict(port).items():
            yield f"serial.{name}.{figure}", value


def _compared(first: float | None, second: float | None) -> Compared:
    if first is None or second is None or first == 0:
        return Compared(first, second, None)
    return Compared(first, second, second / first)


def _number(value: float | None) -> str:
    if value is None:
        return NOT_KNOWN
    return str(value) if isinstance(value, int) else f"{value:.6g}"
