"""What passed ports of a run, for a program: values, instants, a table of them."""

from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from types import ModuleType
from typing import Any, Generic, TypeVar

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.statistics.value_table import (
    ALONE,
    Column,
    beside,
    wide_columns,
    within_64_bits,
)
from firmware_runtime.system.packages import install_command

T = TypeVar("T")


class PortValues(Generic[T]):
    """What passed one port from an instant on, in order; of a run under way it grows.

    Values are kept as they are, in memory, until this is let go.
    """

    def __init__(
        self, path: str, kind: str, passed: Iterable[tuple[int, T]] = (), since: int = 0
    ) -> None:
        self.path = path
        """Of the port, below the root."""
        self._kind = kind
        self._passed = list(passed)
        self._since = since

    def take(self, at: int, value: T) -> None:
        """Add a value that passed at an instant of the run, ns."""
        self._passed.append((at, value))

    def values(self) -> list[T]:
        """Return the values, in the order in which they were sent."""
        return [value for _, value in self._passed]

    def times_ns(self) -> list[int]:
        """Return the instant of each value, ns of the run."""
        return [at for at, _ in self._passed]

    def times_s(self) -> list[float]:
        """Return the instant of each value, seconds of the run."""
        return [at / SECOND for at in self.times_ns()]

    def to_dataframe(self) -> Any:  # noqa: ANN401 -- of pandas, which has no types of its own
        """Return a table with a row for each value, by its second of the run (`t_s`).

        A value with parts has a column for each, such as `acceleration.0`; another one is in
        `value`. It is a DataFrame of pandas, or without pandas a Table of pyarrow, with the column
        `t_ns` beside `t_s`. Raises ConfigError without either.
        """
        return _table(self.times_ns(), wide_columns(self.values()))

    def __len__(self) -> int:
        return len(self._passed)

    def __repr__(self) -> str:
        if not self._passed:
            return f"<PortValues {self.path}: no {self._kind} since {self._since / SECOND:g} s>"
        first, last = (self._passed[place][0] / SECOND for place in (0, -1))
        return f"<PortValues {self.path}: {len(self)} of {self._kind}, {first:g} s to {last:g} s>"


def table_of(ports: Mapping[str, PortValues[Any]]) -> Any:  # noqa: ANN401 -- as above
    """Return a table of several ports, a row for each instant at which any of them sent.

    Its columns are called by port and field, such as `imu.sample.rate.2`; one is empty where that
    port sent nothing. A port that sent several values at an instant has as many rows then. Raises
    ConfigError as `to_dataframe` does.
    """
    places = {path: _places(port.times_ns()) for path, port in ports.items()}
    rows = sorted({place for each in places.values() for place in each})
    row_of = {place: row for row, place in enumerate(rows)}
    columns: dict[str, Column] = {}
    for path, port in ports.items():
        for field, cells in wide_columns(port.values()).items():
            column: Column = [None] * len(rows)
            for place, cell in zip(places[path], cells, strict=True):
                column[row_of[place]] = cell
            columns[path if field == ALONE else f"{path}.{field}"] = column
    return _table([at for at, _ in rows], columns)


def _places(times_ns: Sequence[int]) -> list[tuple[int, int]]:
    """Each instant, and how many of the same came before it."""
    places: list[tuple[int, int]] = []
    for at in times_ns:
        again = bool(places) and places[-1][0] == at
        places.append((at, places[-1][1] + 1 if again else 0))
    return places


def _table(times_ns: Sequence[int], columns: dict[str, Column]) -> Any:  # noqa: ANN401 -- as above
    times_s = [at / SECOND for at in times_ns]
    if (pandas := _installed("pandas")) is not None:
        return pandas.DataFrame(columns, index=pandas.Index(times_s, name="t_s", dtype="float64"))
    if (pyarrow := _installed("pyarrow")) is not None:
        columns = {name: within_64_bits(each) for name, each in columns.items()}
        return pyarrow.table(beside({"t_ns": [*times_ns], "t_s": times_s}, columns))
    fault = f"neither pandas nor pyarrow is installed; expected one: {install_command('pandas')}"
    raise ConfigError.of_one("to_dataframe", fault)


def _installed(name: str) -> ModuleType | None:
    try:
        return import_module(name)
    except ModuleNotFoundError:
        return None
