"""A recording as it was read from its file, up to its last whole batch."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.part_recording.frames import frames_of
from firmware_runtime.part_recording.records import FORMAT, Batch, Ended, Header, Record
from firmware_runtime.recording.file_kind import PART_MAGIC

_batch = msgspec.msgpack.Decoder(Batch).decode
_header = msgspec.msgpack.Decoder(Header).decode


class _Format(Struct):
    """What a header of any format has."""

    format: int


_format = msgspec.msgpack.Decoder(_Format).decode


@dataclass(frozen=True, slots=True)
class Recording:
    """What a part of a robot's model was given in a run, and what it made of it.

    `missing` counts the records that the run dropped; `is_cut` says that the file has no end, as
    when its run was killed.
    """

    header: Header
    records: list[Record]
    missing: int
    ended: Ended | None

    @property
    def is_cut(self) -> bool:
        """Whether the file stops before the run's end was recorded."""
        return self.ended is None

    @property
    def duration_s(self) -> float:
        """From the start of the run to the last instant that was recorded."""
        return max((each.at for each in self.records), default=0) / SECOND

    def incomplete(self) -> str | None:
        """What cannot be known from it, in a sentence; None if it is whole."""
        if self.missing:
            return f"{self.missing} records were dropped in the run"
        return "the file ends before the run did" if self.is_cut else None


def read_recording(path: Path) -> Recording:
    """Read a recording. Raises ConfigError for a file that is none, or of another version."""
    try:
        contents = list(frames_of(path))
    except OSError as error:
        fault = f"cannot be read ({error.strerror}); expected a recording"
        raise ConfigError.of_one(str(path), fault) from error
    if not contents or contents[0] is None:
        fault = f"no recording, which begins with {PART_MAGIC!r} and a header; expected one"
        raise ConfigError.of_one(str(path), fault)
    header = _read_header(path, contents[0])
    records: list[Record] = []
    missing = 0
    for batch in _batches(contents[1:]):
        missing = batch.first - len(records)
        records += batch.records
    last = records[-1] if records else None
    ended = last if isinstance(last, Ended) else None
    return Recording(header, records, missing, ended)


def _read_header(path: Path, content: bytes) -> Header:
    try:
        if (found := _format(content).format) != FORMAT:
            fault = f"a recording of format {found}; expected {FORMAT}"
            raise ConfigError.of_one(str(path), fault)
        return _header(content)
    except msgspec.MsgspecError as error:
        raise ConfigError.of_one(str(path), f"a header that is none: {error}") from error


def _batches(contents: list[bytes | None]) -> Iterator[Batch]:
    """Every batch up to the first that is damaged or none."""
    for content in contents:
        if content is None:
            return
        try:
            yield _batch(content)
        except msgspec.MsgspecError:
            return
