"""The table of a sweep: rows in order, columns by name; as Parquet or as CSV, and back.

Equal rows make equal files. In CSV nothing is an empty cell, floats are written so that they come
back exactly, and a text that would come back as something else stands in quotes of JSON.
"""

import csv
import errno
import io
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from math import isfinite
from pathlib import Path
from typing import Any, Final

import msgspec

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps.plan import Sweep
from firmware_runtime.lab.sweeps.row import EXPERIMENT, RESULT, STATISTICS, Cell, Row
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.system.packages import module_of_extra

ENDINGS: Final = (".parquet", ".csv")
_ORDER: Final = (RESULT, EXPERIMENT, STATISTICS)
_LAST: Final = ("settings_sha256", "code_sha256", "version")


@dataclass(frozen=True)
class Table:
    """Rows of a sweep, in order; what their columns are is gone through once."""

    rows: Sequence[Row]
    maker: str = "sweep"
    """The command that wrote them."""

    @cached_property
    def columns(self) -> list[str]:
        """Names in order: what was set, what came of it, its figures, what ran."""
        names = list(dict.fromkeys(name for row in self.rows for name in row))
        return sorted(names, key=_place)

    @cached_property
    def varied(self) -> list[str]:
        """The keys that were varied."""
        return [name for name in self.columns if "." in name and not name.startswith(_ORDER)]

    @cached_property
    def figures(self) -> list[str]:
        """The columns that say how a run fared: an experiment's own, where there is one.

        A board's result goes by the reference of its file, which an experiment steps away from.
        """
        of_experiment = [name for name in self.columns if name.startswith(EXPERIMENT)]
        return of_experiment or [name for name in self.columns if name.startswith(RESULT)]

    def show(self) -> None:
        """Show its page in a notebook. Raises ConfigError where none runs this."""
        # the page is made of a table, and is loaded by nothing but this call
        import_module("firmware_runtime.lab.sweeps.sweep_page").show_sweep(self)

    def column(self, name: str) -> list[Cell]:
        """One column, None where a row has it not."""
        return [row.get(name) for row in self.rows]

    def row(self, number: int) -> Row:
        """A row by its number. Raises ConfigError."""
        found = next((each for each in self.rows if each["row"] == number), None)
        if found is None:
            numbers = [each["row"] for each in self.rows]
            expected = f"one of its {len(numbers)} rows, {numbers[0]} to {numbers[-1]}"
            raise ConfigError.of_one(self.maker, f"no row {number}", expected=expected)
        return found


def sweep_of(row: Row) -> Sweep:
    """A sweep of one row: the run of this one, without the distributions. Raises ConfigError."""
    for_s, experiment = row.get("for_s"), row.get("experiment")
    return Sweep(
        board=str(row["board"]),
        vary={},
        assignments=_assignments(row),
        runs=1,
        for_s=float(for_s) if isinstance(for_s, int | float) else None,
        experiment=None if experiment is None else str(experiment),
    )


def write_table(table: Table, path: Path) -> None:
    """Write it whole, by the ending of its name. Raises ConfigError."""
    keep_output(path, _parquet(table) if path.suffix == ".parquet" else _csv(table).encode())


def read_table(path: Path, maker: str = "sweep") -> Table:
    """Read a table that a sweep has written, or another such command. Raises ConfigError."""
    if path.suffix not in ENDINGS:
        raise ConfigError.of_one(str(path), f"expected a file named {' or '.join(ENDINGS)}")
    try:
        if path.suffix == ".parquet":
            rows = module_of_extra("pyarrow.parquet", "parquet").read_table(path).to_pylist()
        else:
            rows = _from_csv(path)
    except OSError as error:
        absent = os.strerror(errno.ENOENT) if isinstance(error, FileNotFoundError) else None
        why = error.strerror or absent or error
        fault = f"cannot be read ({why}); expected a {maker}'s table"
        raise ConfigError.of_one(str(path), fault) from error
    except (ValueError, KeyError, TypeError, RecursionError, csv.Error) as error:
        fault = f"no {maker}'s table, or not whole; expected one that `{maker}` has written"
        raise ConfigError.of_one(str(path), fault) from error
    fault = next(filter(None, map(_fault_of, rows)), "it has no rows" if not rows else "")
    if fault:
        raise ConfigError.of_one(
            str(path), f"no {maker}'s table: {fault}", expected=f"one that `{maker}` has written"
        )
    return Table(rows, maker)


def _fault_of(row: Row) -> str:
    """Return why this is no row of a sweep that a run can be repeated by; empty if it is."""
    number = row.get("row")
    if not isinstance(number, int):
        return "it has rows without a number"
    for name in ("board", "outcome"):
        if not isinstance(row.get(name), str):
            return f"row {number} has no {name}"
    try:
        _assignments(row)
    except msgspec.DecodeError:
        return f"what row {number} has set is no list of KEY=VALUE in JSON"
    return ""


def _assignments(row: Row) -> list[str]:
    """The overrides of a row. Raises msgspec.DecodeError for what is no list of texts."""
    stated = row.get("set")
    return msgspec.json.decode(str(stated), type=list[str]) if stated else []


def _place(name: str) -> int:
    """Return the place of a column's kind; columns of one kind stay in their order."""
    if name in _LAST:
        return len(_ORDER) + 1
    return next((place for place, begin in enumerate(_ORDER, 1) if name.startswith(begin)), 0)


# Parquet -----------------------------------------------------------------------------------------


def _parquet(table: Table) -> bytes:
    pyarrow = module_of_extra("pyarrow", "parquet")
    parquet = module_of_extra("pyarrow.parquet", "parquet")
    columns = {name: _typed(pyarrow, table.column(name)) for name in table.columns}
    into = io.BytesIO()
    parquet.write_table(pyarrow.table(columns), into)
    return into.getvalue()


def _typed(pyarrow: Any, cells: list[Cell]) -> object:  # noqa: ANN401 -- has no types
    """A column of one type: whole numbers, numbers, truths, or texts, as CSV has them."""
    kinds = {type(cell) for cell in cells if cell is not None}
    if not kinds:
        return pyarrow.array(cells, type=pyarrow.string())
    if kinds == {int, float}:
        cells = [float(cell) if isinstance(cell, int) else cell for cell in cells]
    elif len(kinds) > 1 or any(isinstance(cell, int) and abs(cell) >= 1 << 63 for cell in cells):
        cells = [None if cell is None else _cell(cell) for cell in cells]
    return pyarrow.array(cells)


# CSV ---------------------------------------------------------------------------------------------


def _csv(table: Table) -> str:
    into = io.StringIO()
    writer = csv.writer(into, lineterminator="\n")
    writer.writerow(table.columns)
    for row in table.rows:
        writer.writerow([_cell(row.get(name)) for name in table.columns])
    return into.getvalue()


def _from_csv(path: Path) -> list[Row]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = csv.DictReader(file, strict=True)
        return [{name: _value(text) for name, text in row.items()} for row in rows]


def _cell(value: Cell) -> str:
    if isinstance(value, str):
        return value if value != "" and _value(value) == value else json.dumps(value)
    return "" if value is None else json.dumps(value)


def _value(text: str) -> Cell:
    """Read a cell: JSON's numbers, truths and texts, or else a plain text.

    What is no number of JSON, or beyond any float, is a text.
    """
    if text == "":
        return None
    try:
        found = json.loads(text)
        if isinstance(found, int | float) and not isfinite(found):
            return text
    except (ValueError, OverflowError):
        return text
    return found if isinstance(found, bool | int | float | str) else text
