"""Recordings of models without a board, in memory."""

from pathlib import Path
from tempfile import TemporaryDirectory

from firmware_runtime.part_recording.cut import Cut, type_name
from firmware_runtime.part_recording.recording import Recording, read_recording
from firmware_runtime.part_recording.records import FORMAT, Header
from firmware_runtime.recording.file_kind import PART_MAGIC


class KeptFrames:
    """A sink that keeps the bytes of a recording; `has_room` False: it takes none."""

    def __init__(self) -> None:
        self.content = bytearray(PART_MAGIC)
        self.has_room = True

    def take(self, frame: bytes) -> bool:
        if self.has_room:
            self.content += frame
        return self.has_room

    def close(self) -> str | None:
        return None


def header_of(cut: Cut) -> Header:
    """The header of a recording of a model that is no board's."""
    return Header(
        format=FORMAT,
        board="model",
        kind="model",
        fingerprint="",
        source="",
        table={},
        role="controller",
        components=list(cut.names),
        entering={each.name: type_name(each.port.type) for each in cut.entrances.values()},
        crossings=list(cut.entrances),
        positions=[each.position for each in cut.entrances.values()],
        leaving={name: type_name(port.type) for name, port in cut.leaving.items()},
        code={},
        code_sha256="",
        versions={},
        clock="VirtualClock",
    )


def recording_of(sink: KeptFrames) -> Recording:
    """What a sink has kept, read as a file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "model.recording"
        path.write_bytes(sink.content)
        return read_recording(path)
