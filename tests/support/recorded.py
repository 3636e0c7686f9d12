"""Small recordings: a run of a board on doubles in virtual time, in chunks of a few sections."""

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.recording.blackbox.layout import Chunk, file_of
from firmware_runtime.recording.blackbox.reader import Recording, kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session


def record(
    path: Path,
    board: str,
    span_s: float,
    settings: Sequence[str] = (),
    before: Callable[[Session], None] = lambda _: None,
    *,
    log: Callable[[str], None] = lambda _: None,
) -> Path:
    """Run a board, and leave its recording at `path`."""
    found = board_in_force(board, ("recording.minutes=0.1", *settings))
    session = start_session(
        found, VirtualClock(), doubles=True, statistics_path=None, recording=path, log=log
    )
    try:
        before(session)
        session.run(round(span_s * SECOND))
    finally:
        session.close()
    return path


def in_chunks(path: Path, sections: int) -> bytes:
    """The same recording with so many sections in a chunk, beside its header."""
    (first, *_), *_ = (each.contents for each in read_recording(path).chunks)
    contents = every_section(path)
    groups = [contents[at : at + sections] for at in range(0, len(contents), sections)]
    return file_of([Chunk(n, [first, *each]) for n, each in enumerate(groups, start=1)])


def recording_in(content: bytes) -> Recording:
    """What the bytes of a file hold."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "x.recording"
        path.write_bytes(content)
        return read_recording(path)


def rewrite(path: Path, sections: Sequence[bytes], number: int = 1) -> None:
    """Leave these sections alone in it, behind its header, in one chunk of that number."""
    header = read_recording(path).chunks[0].contents[0]
    path.write_bytes(file_of([Chunk(number, [header, *sections])]))


def every_section(path: Path) -> list[bytes]:
    """All but the headers, as bytes."""
    chunks = read_recording(path).chunks
    every = [each for chunk in chunks for each in chunk.contents]
    return [each for each in every if kind_of(each) != Kind.HEADER]
