"""Rows in the blocks of a statistics file, cell by cell: one class a block, by name.

Nothing but signed 64-bit integers. The order of the fields is their order in the file. A field that
has the name of a figure (`figures`) is that figure.
"""

from collections.abc import Callable, Sequence
from typing import Annotated, TypeAlias, TypeVar, get_type_hints

from msgspec import Struct

from firmware_runtime.statistics.histogram import Cells

Row = TypeVar("Row", bound=Struct)
Counter: TypeAlias = Annotated[int, "only grows"]
"""A cell that two readings of one run subtract, and readings of several runs add up."""


class ModelRow(Struct, frozen=True):
    """Counters of one model; its histograms follow in the file."""

    scheduled: Counter
    run: Counter
    skipped: Counter
    coalesced: Counter
    overruns: Counter
    episodes: Counter
    last_late_ns: int
    due_ns: int
    is_in_period: int
    irregular: Counter
    returned_ns: int
    reactions: Counter


class BusRow(Struct, frozen=True):
    """Counters of one bus, since it was opened."""

    transactions: Counter
    bytes: Counter
    errors: Counter
    retries: Counter
    busy_ns: Counter


class SerialRow(Struct, frozen=True):
    """Counters of one serial port, since it was opened."""

    writes: Counter
    bytes_written: Counter
    bytes_read: Counter
    errors: Counter
    writing_ns: Counter
    reading_ns: Counter


class LinkRow(Struct, frozen=True):
    """Counters of a link; its histograms of age and round trip follow in the file.

    The fields from `malformed` on are refusals by reason.
    """

    is_good: int
    sent: Counter
    repeated: Counter
    received: Counter
    dropped: Counter
    overtaken: Counter
    given_up: Counter
    unconnected: Counter
    unsent: Counter
    silences: Counter
    malformed: Counter
    oversized: Counter
    forged: Counter
    replayed: Counter
    stale: Counter
    went_back: Counter
    wrong_session: Counter
    other_cut: Counter
    too_old: Counter
    unknown_port: Counter
    not_finite: Counter
    out_of_limits: Counter


REFUSALS = LinkRow.__struct_fields__[LinkRow.__struct_fields__.index("malformed") :]
"""Why datagrams of a link are refused, each with a cell of its own."""


class DeadlineRow(Struct, frozen=True):
    """Counters of one deadline on a path."""

    misses: Counter
    samples: Counter
    answers: Counter


class WorstRow(Struct, frozen=True):
    """One of the worst activations; own times and devices follow in the file."""

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


def counters(kind: type[Struct]) -> list[str]:
    """The fields of a row that only grow."""
    hints = get_type_hints(kind, include_extras=True)
    return [name for name in kind.__struct_fields__ if hints[name] == Counter]


def as_counted(row: Struct, figures: type[Struct]) -> dict[str, int]:
    """The fields of a row that have the name of a figure."""
    return {
        name: getattr(row, name)
        for name in row.__struct_fields__
        if name in figures.__struct_fields__
    }
