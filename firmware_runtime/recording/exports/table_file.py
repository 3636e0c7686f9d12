"""Table of what left the ports of a run: CSV or Parquet.

Of all ports it is long: `t_ns, t_s, utc, port, field, value, text`, a row for each number, with
`value` empty for what is none. Of one port it is wide: `t_ns, t_s, utc` and a column for each
field. `utc` is the date, where that is known.
"""

import csv
import io
from collections.abc import Iterable
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.exports.typed_values import Sent, cells_of
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.number_formats import NO_DATES, Dates, utc
from firmware_runtime.system.packages import module_of_extra

UTC: Final = "utc"
LONG: Final = ("t_ns", "t_s", UTC, "port", "field", "value", "text")
ALONE: Final = "value"
"""The column of a value that has no fields."""
Column: TypeAlias = list[Any]


def long_table(sent: Iterable[Sent], dates: Dates = NO_DATES) -> dict[str, Column]:
    """Columns of equal length, in the order of `LONG`."""
    rows = (
        (each.at, each.at / SECOND, dates.of(each.at), each.port, field, *_number_or_text(cell))
        for each in sent
        for field, cell in cells_of(plain(each.value))
    )
    columns = list(zip(*rows, strict=True)) or [()] * len(LONG)
    return {name: list(column) for name, column in zip(LONG, columns, strict=True)}


def wide_table(sent: Iterable[Sent], dates: Dates = NO_DATES) -> dict[str, Column]:
    """A row for each value of a port; a field that one has not is empty in its row."""
    rows = [(each.at, dict(cells_of(plain(each.value)))) for each in sent]
    names = dict.fromkeys(name for _, row in rows for name in row)
    columns: dict[str, Column] = {
        "t_ns": [at for at, _ in rows],
        "t_s": [at / SECOND for at, _ in rows],
        UTC: [dates.of(at) for at, _ in rows],
    }
    for name in names:
        columns[name or ALONE] = _of_one_kind([row.get(name) for _, row in rows])
    return columns


def csv_of(columns: dict[str, Column]) -> bytes:
    """The bytes of a CSV file, floats so that the same come back."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    if UTC in columns:
        said = [None if date is None else utc(date) for date in columns[UTC]]
        columns = {**columns, UTC: said}
    for row in zip(*columns.values(), strict=True):
        writer.writerow("" if cell is None else _csv_cell(cell) for cell in row)
    return text.getvalue().encode()


def parquet_of(columns: dict[str, Column]) -> bytes:
    """The bytes of a Parquet file. Raises ConfigError without pyarrow."""
    pyarrow = module_of_extra("pyarrow", "sweep")
    parquet = module_of_extra("pyarrow.parquet", "sweep")
    known = {"t_ns": pyarrow.int64(), "t_s": pyarrow.float64()}
    known[UTC] = pyarrow.timestamp("us", tz="UTC")  # ns are read by pandas alone
    columns = {**columns, UTC: [None if each is None else each // 1000 for each in columns[UTC]]}
    known |= {"port": pyarrow.string(), "field": pyarrow.string(), "text": pyarrow.string()}
    if tuple(columns) == LONG:
        known["value"] = pyarrow.float64()
    arrays = {name: pyarrow.array(each, known.get(name)) for name, each in columns.items()}
    into = io.BytesIO()
    parquet.write_table(pyarrow.table(arrays), into)
    return into.getvalue()


def _number_or_text(cell: object) -> tuple[float | None, str | None]:
    if cell is None:
        return None, None
    number = _number(cell)
    return (None, str(cell)) if number is None else (number, None)


def _number(cell: object) -> float | None:
    if cell in {"nan", "inf", "-inf"} or isinstance(cell, int | float):
        try:
            return float(cell)
        except OverflowError:  # a whole number beyond any float: as text
            return None
    return None


def _of_one_kind(cells: Column) -> Column:
    """As they are where all are of one kind; as numbers, or else as texts, where they are not."""
    kinds = {type(each) for each in cells if each is not None}
    if len(kinds) < 2 and float not in kinds:
        return cells
    numbers = [None if each is None else _number(each) for each in cells]
    if all((number is None) == (cell is None) for number, cell in zip(numbers, cells, strict=True)):
        return numbers
    return [None if each is None else str(each) for each in cells]


def _csv_cell(cell: object) -> object:
    return str(cell).lower() if isinstance(cell, bool) else cell
