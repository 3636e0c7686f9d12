"""One recording replayed here and judged; its file says what kind of recording it is.

A `Replayer` takes one kind: that of a whole run, or that of `run --record`, which has a part of it.
"""

import hashlib
from pathlib import Path
from typing import Final, Protocol

from msgspec.structs import replace as with_changed

from firmware_runtime.blackbox.found import is_black_box
from firmware_runtime.blackbox.models import own_atomics
from firmware_runtime.blackbox.reader import read_recording as read_run
from firmware_runtime.certification.finding import Finding
from firmware_runtime.certification.found import finding_of, finding_of_run
from firmware_runtime.part_recording.of_board import part_code, replay_of
from firmware_runtime.part_recording.recording import read_recording
from firmware_runtime.recording.code import code_of
from firmware_runtime.recording.file_kind import is_of_part
from firmware_runtime.recording.of_board import board_of
from firmware_runtime.replay.verdict import replay


class Replayer(Protocol):
    """Replays one kind of recording."""

    def takes(self, path: Path) -> bool:
        """Whether a file is of its kind, by its first bytes."""

    def replay(self, path: Path) -> Finding:
        """Replay it. Raises ConfigError for one that cannot be read."""


class OfRole:
    """What entered a part of a robot's model, recorded by `run --record`."""

    def takes(self, path: Path) -> bool:
        """Whether it begins as such a file does."""
        return is_of_part(path)

    def replay(self, path: Path) -> Finding:
        """Replay it in this process. Raises ConfigError."""
        recording = read_recording(path)
        board = board_of(recording.header)
        code = part_code(board, recording.header.components)
        comparison = replay_of(recording, board)
        found = finding_of(recording, comparison, code)
        return with_changed(found, recording=path.name, sha256=_sha256(path))


class OfRun:
    """What entered a whole run at its edge: bytes, events, the clock."""

    def takes(self, path: Path) -> bool:
        """Whether it begins as such a file does."""
        return is_black_box(path)

    def replay(self, path: Path) -> Finding:
        """Replay it in this process. Raises ConfigError."""
        recording = read_run(path)
        header = recording.header
        board = board_of(header)
        verdict = replay(recording, board)
        model = board.unconnected().model
        code = code_of(own_atomics(model))
        if header.role is not None:  # of one end of two: what that end had
            code = {name: code[name] for name in header.code if name in code}
        found = finding_of_run(header, verdict, code)
        return with_changed(found, recording=path.name, sha256=_sha256(path))


REPLAYERS: Final[tuple[Replayer, ...]] = (OfRun(), OfRole())


def replayed(path: Path) -> Finding:
    """Replay a recording of any kind. Raises ConfigError."""
    of_its_kind = (each for each in REPLAYERS if each.takes(path))
    return next(of_its_kind, REPLAYERS[0]).replay(path)  # whose reading says what is wrong


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
