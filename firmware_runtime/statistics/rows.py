"""What stands in the blocks of a statistics file, cell by cell: one class a block, by name.

Nothing but signed 64-bit integers. The order of the fields is their order in the file.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

from msgspec import Struct

from firmware_runtime.statistics.histogram import Cells

Row = TypeVar("Row", bound=Struct)


class ModelRow(Struct, frozen=True):
    """Of one model; its histograms follow in the file."""

    scheduled: int
    run: int
    skipped: int
    coalesced: int
    overruns: int
    episodes: int
    last_late_ns: int
    due_ns: int
    is_in_period: int
    irregular: int
    returned_ns: int
    reactions: int


class BusRow(Struct, frozen=True):
    """Of one bus, since it was opened."""

    transactions: int
    bytes: int
    errors: int
    retries: int
    busy_ns: int


class DeadlineRow(Struct, frozen=True):
    """Of one deadline on a path."""

    misses: int
    samples: int
    answers: int


class WorstRow(Struct, frozen=True):
    """Of one of the worst activations; own times and devices follow in the file."""

    t_ns: int
    model: int
    lateness_ns: int
    step_ns: int
    wake_ns: int
    behind_ns: int
    garbage_ns: int


def read_row(kind: type[Row], cells: Cells, first: int) -> Row:
    """The row that begins at a cell."""
    return kind(*cells[first : first + len(kind.__struct_fields__)])


def read_rows(
    kind: type[Row], cells: Cells, names: Sequence[str], first: Callable[[int], int]
) -> dict[str, Row]:
    """Rows by name; `first` gives the cell at which each begins, by its number."""
    return {name: read_row(kind, cells, first(index)) for index, name in enumerate(names)}
