"""The process that answers a question with the code that is first on its import path.

    python -P -m firmware_runtime.what_if.elsewhere FOLDER < QUESTION > ANSWER

Prints what was found as JSON; what cannot be found out is a sentence on standard error, status 2.
There goes what the code prints, too.
"""

import os
import sys
from pathlib import Path
from typing import BinaryIO

import msgspec

from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.replay.what_if import WhatIf
from firmware_runtime.what_if.question import Question, answer


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
    """How many modules of this process lie in a folder, but not in an environment in it."""
    files = [getattr(each, "__file__", None) for each in [*sys.modules.values()]]
    inside = [Path(file) for file in files if file and Path(file).is_relative_to(folder)]
    return sum("site-packages" not in each.parts for each in inside)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1]))
