"""One recording replayed here and judged; what kind of recording it is, is told by its file.

A `Replayer` takes one kind. A recording of `run --record` is replayed in this process; any other is
handed to `replay RUN --json`, whose answer says `identical`, `events` and `first_difference`.
"""

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Final, Protocol

from msgspec.structs import replace

from firmware_runtime.certification.finding import Finding
from firmware_runtime.certification.found import finding_of, finding_of_document
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.frames import MAGIC
from firmware_runtime.recording.of_board import board_of, part_code, replay_of
from firmware_runtime.recording.recording import read_recording

LIMIT_S: Final = 3600.0
"""Longest wait for the replay of one recording by another process."""


class Replayer(Protocol):
    """Replays one kind of recording."""

    def takes(self, path: Path) -> bool:
        """Whether a file is of its kind, by its first bytes."""

    def replay(self, path: Path) -> Finding:
        """Replay it. Raises ConfigError for one that cannot be read."""


class OfRole:
    """What entered a part of a robot's model, recorded by `run --record`."""

    def takes(self, path: Path) -> bool:
        """Whether it begins as such a file does. Raises OSError."""
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def replay(self, path: Path) -> Finding:
        """Replay it in this process. Raises ConfigError."""
        recording = read_recording(path)
        board = board_of(recording.header)
        code = part_code(board, recording.header.components)
        comparison = replay_of(recording, board)
        found = finding_of(recording, comparison, code)
        return replace(found, recording=path.name, sha256=_sha256(path))


class ByVerb:
    """Any other recording: the verb `replay` knows its kind."""

    def takes(self, path: Path) -> bool:
        """Any file."""
        return path.is_file()

    def replay(self, path: Path) -> Finding:
        """Let a process of its own replay it. Raises ConfigError with what that process said."""
        words = [sys.executable, "-P", "-m", "firmware_runtime.cli", "replay", str(path), "--json"]
        try:
            ended = subprocess.run(  # noqa: S603 -- this project's own command
                words, capture_output=True, text=True, timeout=LIMIT_S, check=False
            )
            said = json.loads(ended.stdout)
        except subprocess.TimeoutExpired as error:
            fault = f"its replay did not end within {LIMIT_S:g} s"
            raise ConfigError.of_one(str(path), fault) from error
        except ValueError as error:
            last = (ended.stderr.strip().splitlines() or ["its replay said nothing"])[-1]
            raise ConfigError.of_one(str(path), last.removeprefix("firmware-runtime: ")) from error
        return replace(finding_of_document(said), recording=path.name, sha256=_sha256(path))


REPLAYERS: Final[tuple[Replayer, ...]] = (OfRole(), ByVerb())


def replayed(path: Path) -> Finding:
    """Replay a recording of any kind. Raises ConfigError."""
    try:
        replayer = next(each for each in REPLAYERS if each.takes(path))
    except (OSError, StopIteration) as error:
        fault = f"{getattr(error, 'strerror', None) or 'no file'}; expected a recording"
        raise ConfigError.of_one(str(path), fault) from error
    return replayer.replay(path)


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
