"""Table of what left the ports of a run: CSV or Parquet.

Of all ports it is long: `t_ns, t_s, utc, port, field, value, text`, a row for each number, with
`value` empty for what is none. Of one port it is wide: `t_ns, t_s, utc` and a column for each
field. `utc` is the date, where that is known.
"""

import csv
import io
from collections.abc import Iterable
from typing import Any, Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.exports.typed_values import Sent
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.number_formats import NO_DATES, Dates, utc
from firmware_runtime.statistics.value_table import Column, cells_of, number_of, wide_columns
from firmware_runtime.system.packages import module_of_extra

UTC: Final = "utc"
LONG: Final = ("t_ns", "t_s", UTC, "port", "field", "value", "text")


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
    rows = list(sent)
    return {
        "t_ns": [each.at for each in rows],
        "t_s": [each.at / SECOND for each in rows],
        UTC: [dates.of(each.at) for each in rows],
        **wide_columns(each.value for each in rows),
    }


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
    number = number_of(cell)
    return (None, str(cell)) if number is None else (number, None)


def _csv_cell(cell: Any) -> Any:  # noqa: ANN401
    return str(cell).lower() if isinstance(cell, bool) else cell
