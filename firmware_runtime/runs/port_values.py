"""What passes a port of a model while it runs, for a program: values, instants, a DataFrame."""

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.value_table import wide_columns
from firmware_runtime.system.packages import module_of_extra

if TYPE_CHECKING:
    from firmware_runtime.executive.executive import Executive

T = TypeVar("T")


class PortValues(Generic[T]):
    """All that passes one port from when it was first asked for; what came before is not kept.

    Values are kept as they are, in memory, until the run is closed and this is let go.
    """

    def __init__(self, port: InPort[T] | OutPort[T], executive: "Executive") -> None:
        self.port = port
        self._passed: list[tuple[int, T]] = []
        self._since = executive.reached
        executive.simulator.listen(port, lambda at, value: self._passed.append((at, value)))

    def values(self) -> list[T]:
        """Return the values, in the order in which they were sent."""
        return [value for _, value in self._passed]

    def times_s(self) -> list[float]:
        """Return the instant of each value, seconds of the run."""
        return [at / SECOND for at, _ in self._passed]

    def to_dataframe(self) -> Any:  # noqa: ANN401 -- of pandas, which has no types of its own
        """Return a DataFrame with a row for each value, by its second of the run (`t_s`).

        A value with parts has a column for each, such as `acceleration.0`; another one is in
        `value`. Raises ConfigError without the extra pandas.
        """
        pandas = module_of_extra("pandas", "pandas")
        index = pandas.Index(self.times_s(), name="t_s", dtype="float64")
        return pandas.DataFrame(wide_columns(self.values()), index=index)

    def __len__(self) -> int:
        return len(self._passed)

    def __repr__(self) -> str:
        path, kind = below_root(self.port.path), self.port.type.__name__
        if not self._passed:
            return f"<PortValues {path}: no {kind} since {self._since / SECOND:g} s>"
        first, last = (self._passed[place][0] / SECOND for place in (0, -1))
        return f"<PortValues {path}: {len(self)} of {kind}, {first:g} s to {last:g} s>"
