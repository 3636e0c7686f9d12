"""A recorded run as the content of a file for other programs, by the ending of its name."""

import csv
import io
import json
import re
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError
from firmware_runtime.recording.blackbox.listing import span_of
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.chosen_ports import ChosenPorts
from firmware_runtime.recording.exports.mcap_file import mcap_of
from firmware_runtime.recording.exports.observed_run import moments_of
from firmware_runtime.recording.exports.perfetto import chrome_trace
from firmware_runtime.recording.exports.typed_values import (
    Sent,
    model_of,
    passed,
    sections_between,
)
from firmware_runtime.recording.replay.stretch import Stretch
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.late_watch import Late
from firmware_runtime.statistics.number_formats import NO_DATES, Dates, instant, utc
from firmware_runtime.statistics.paths import SUFFIX
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.statistics.value_table import (
    Column,
    beside,
    cells_of,
    number_of,
    wide_columns,
    within_64_bits,
)
from firmware_runtime.system.packages import module_of_extra

UTC: Final = "utc"
LONG: Final = ("t_ns", "t_s", UTC, "port", "field", "value", "text")


def long_table(
    sent: Iterable[Sent], dates: Dates = NO_DATES, chosen: ChosenPorts | None = None
) -> dict[str, Column]:
    """Columns of equal length, in the order of `LONG`."""
    rows = (
        (each.at, each.at / SECOND, dates.of(each.at), each.port, field, *_number_or_text(cell))
        for each in sent
        for field, cell in cells_of(plain(each.value))
        if chosen is None or chosen.has_field(each.port, field)
    )
    columns = list(zip(*rows, strict=True)) or [()] * len(LONG)
    return {name: list(column) for name, column in zip(LONG, columns, strict=True)}


def wide_table(
    sent: Iterable[Sent], dates: Dates = NO_DATES, chosen: ChosenPorts | None = None
) -> dict[str, Column]:
    """A row for each value of a port; a field that one has not is empty in its row."""
    rows = list(sent)
    columns = wide_columns(each.value for each in rows)
    if chosen is not None:
        columns = {name: each for name, each in columns.items() if chosen.shows(name)}
    instants: dict[str, Column] = {
        "t_ns": [each.at for each in rows],
        "t_s": [each.at / SECOND for each in rows],
        UTC: [dates.of(each.at) for each in rows],
    }
    return beside(instants, columns)


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
    pyarrow = module_of_extra("pyarrow", "parquet")
    parquet = module_of_extra("pyarrow.parquet", "parquet")
    known = {"t_ns": pyarrow.int64(), "t_s": pyarrow.float64()}
    known[UTC] = pyarrow.timestamp("us", tz="UTC")  # ns are read by pandas alone
    columns = {**columns, UTC: [None if each is None else each // 1000 for each in columns[UTC]]}
    if tuple(columns) == LONG:
        known |= {"port": pyarrow.string(), "field": pyarrow.string(), "text": pyarrow.string()}
        known["value"] = pyarrow.float64()
    arrays = {
        name: pyarrow.array(within_64_bits(each), known.get(name)) for name, each in columns.items()
    }
    into = io.BytesIO()
    parquet.write_table(pyarrow.table(arrays), into)
    return into.getvalue()


def _number_or_text(cell: object) -> tuple[float | None, str | None]:
    if cell is None:
        return None, None
    number = number_of(cell)
    return (None, str(cell)) if number is None else (number, None)


def _csv_cell(cell: object) -> object:
    return str(cell).lower() if isinstance(cell, bool) else cell


_INCIDENT: Final = re.compile(r"-[a-z]+-\d+$")
"""What follows the number of the run in the name of a piece that was collected."""


def check_stretch(recording: Recording, stretch: Stretch) -> None:
    """Raise ConfigError for a stretch that begins when the run is over."""
    if (last := span_of(recording)[1]) < stretch.begin:
        where, ends = f"--from {stretch.begin / SECOND:g}", f"the run ends at {last / SECOND:g} s"
        raise ConfigError.of_one(where, ends, expected="an instant before")


def mcap_content(recording: Recording, stretch: Stretch, names: Sequence[str] = ()) -> bytes:
    """Topics of ROS 2, other ports, transfers and markers as MCAP. Raises ConfigError.

    With names what these ports sent alone, and the markers.
    """
    header = recording.header
    board = board_of(header)
    chosen = ChosenPorts(names, header, model_of(header, board)) if names else None
    sections = sections_between(recording, stretch.begin, stretch.until)
    return mcap_of(header, board, sections, recording.dates(), chosen)


def table_content(
    recording: Recording, stretch: Stretch, names: Sequence[str], ending: str
) -> bytes:
    """What left ports, all or those of these names, as a table by that ending. Raises ConfigError.

    One port has a column for each field.
    """
    header = recording.header
    board = board_of(header)
    chosen = ChosenPorts(names, header, model_of(header, board)) if names else None
    sent = passed(recording, board, stretch.begin, stretch.until)
    if chosen is not None:
        sent = (each for each in sent if chosen.has(each.port))
    if len(names) == 1:
        columns = wide_table(sent, recording.dates(), chosen)
    else:
        columns = long_table(sent, recording.dates(), chosen)
    return csv_of(columns) if ending == ".csv" else parquet_of(columns)


class PerfettoTrace(NamedTuple):
    """What ran when, for Perfetto, and what that is in a few words."""

    content: bytes
    said: str


def perfetto_trace(
    recording: Recording, stretch: Stretch, trigger: Late | None = None
) -> PerfettoTrace:
    """Run a stretch of a recording again, and note what ran when. Raises ConfigError."""
    board: Board = board_of(recording.header)
    steps = [each for each in moments_of(recording, board, stretch) if each.is_step]
    trace = chrome_trace(board.name, steps, _statistics_of(recording), trigger)
    functions = sum(len(each.ran) for each in steps)
    first, end = (steps[0].begin, steps[-1].end) if steps else (0, 0)
    passed = f"from {instant(first)} to {instant(end)}"
    said = f"{len(steps)} steps, {functions} functions, {passed}"
    return PerfettoTrace(json.dumps(trace, allow_nan=False).encode(), said)


def _statistics_of(recording: Recording) -> Statistics | None:
    """Of its run, beside it, or where they were collected; None if those are another run's."""
    path = recording.path
    stems = path.stem, _INCIDENT.sub("", path.stem)
    for each in dict.fromkeys(path.with_name(f"{stem}{SUFFIX}") for stem in stems):
        try:
            statistics = read_statistics(each)
        except StatisticsFileError:
            continue
        if recording.header.run.endswith(f"-{statistics.header.writer.pid}"):
            return statistics
    return None
