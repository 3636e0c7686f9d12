"""The process that answers a question with the code that is first on its import path.

    python -P -m firmware_runtime.recording.what_if.elsewhere FOLDER < QUESTION > ANSWER

Prints what was found as JSON; what cannot be found out is a sentence on standard error, status 2.
There goes what the code prints, too.
"""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import msgspec

from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.recording.what_if.question import Question, answer
from firmware_runtime.recording.what_if.what_if import WhatIf
from firmware_runtime.system.packages import import_path


class Answer(msgspec.Struct):
    """What was found, and how many modules the folder gave."""

    found: WhatIf
    used: int


def main(folder: str) -> int:
    """Answer the one question."""
    output = _own_output()
    question = msgspec.json.decode(sys.stdin.buffer.read(), type=Question)
    try:
        found = answer(question)
    except FirmwareRuntimeError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    with output:
        output.write(msgspec.json.encode(Answer(found, _used(Path(folder)))))
    return 0


def _own_output() -> BinaryIO:
    """Standard output for the answer alone; standard error is that of all else."""
    own = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return own


def _used(folder: Path) -> int:
    """Number of modules of this process that were imported from a folder."""
    places = import_path(folder)
    found = [(name, getattr(each, "__file__", None)) for name, each in [*sys.modules.items()]]
    return sum(_imported_as(Path(file)) in _at(places, name) for name, file in found if file)


def _imported_as(file: Path) -> Path:
    """A module's file without its ending; of a package its folder."""
    return file.parent if file.stem == "__init__" else file.with_name(file.name.partition(".")[0])


def _at(places: Sequence[Path], name: str) -> list[Path]:
    return [place.joinpath(*name.split(".")) for place in places]


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1]))
