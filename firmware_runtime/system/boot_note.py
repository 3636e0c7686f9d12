"""Notes in files that count for the boot in which they were left, as JSON."""

from pathlib import Path
from time import monotonic_ns
from typing import Annotated, TypeVar

import msgspec

from firmware_runtime.system.atomic_file import read_file, replace_file
from firmware_runtime.system.process_identity import is_this_boot


class NoteOfBoot(msgspec.Struct, frozen=True, kw_only=True):
    """Left at the instant `at_ns` (CLOCK_MONOTONIC) of that boot."""

    boot_id: str
    at_ns: Annotated[int, msgspec.Meta(ge=0)]


Note = TypeVar("Note", bound=NoteOfBoot)


def leave_note(path: Path, note: NoteOfBoot, mode: int) -> None:
    """Put it there, in place of the one before, with these permissions. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, msgspec.json.encode(note), mode)


def read_note(path: Path, kind: type[Note]) -> Note | None:
    """What was left there in this boot; None for nothing, or what is no such note."""
    try:
        found = msgspec.json.decode(read_file(path), type=kind)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None
    return found if is_this_boot(found.boot_id) and found.at_ns <= monotonic_ns() else None
