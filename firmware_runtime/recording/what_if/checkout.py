"""Asks the code of a folder, in a process of its own: PYTHONPATH has the folder first.

An editable installation finds its packages after the import path, so the folder's come first;
entry points are the installation's, and lead to the folder's modules. The interpreter is that of
the folder's own environment (`.venv`), if it has one.
"""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

import msgspec

from firmware_runtime.errors import ConfigError, FirmwareRuntimeError
from firmware_runtime.recording.what_if.what_if import Question, WhatIf, answer
from firmware_runtime.system.packages import import_path

_MODULE = "firmware_runtime.recording.what_if.checkout"
_EXPECTED = "expected a folder with the code of this robot, its drivers or the runtime"


def checked_folder(folder: Path) -> Path:
    """The folder, whole. Raises ConfigError if there is none."""
    if not folder.is_dir():
        raise ConfigError.of_one(f"--with {folder}", f"no folder; {_EXPECTED}")
    return folder.resolve()


def ask(question: Question, folder: Path | None) -> WhatIf:
    """Ask the folder's code; without a folder, the installed code as it is now.

    What the code prints goes to standard error. Raises ConfigError with what its process said where
    it does not answer.
    """
    done = subprocess.run(  # noqa: S603 -- an interpreter, and our module
        [_interpreter(folder), "-P", "-m", _MODULE, str(folder or os.sep)],
        input=msgspec.json.encode(question),
        capture_output=True,
        check=False,
        env=_environment(folder),
    )
    where = "replay" if folder is None else f"--with {folder}"
    if done.returncode < 0:
        fault = f"its process was ended by signal {-done.returncode}"
        raise ConfigError.of_one(where, f"{fault}; {_EXPECTED}")
    if done.returncode != 0:
        raise ConfigError.of_one(where, _why(done.stderr.decode(errors="replace")))
    try:
        said = msgspec.json.decode(done.stdout, type=Answer)
    except msgspec.MsgspecError as error:
        fault = f"its answer is not one of this version ({error})"
        raise ConfigError.of_one(where, f"{fault}; {_EXPECTED}") from error
    sys.stderr.write(done.stderr.decode(errors="replace"))
    if folder is not None and said.used == 0:
        raise ConfigError.of_one(where, f"no module of the robot is in it; {_EXPECTED}")
    return said.found


def _interpreter(folder: Path | None) -> str:
    own = None if folder is None else folder / ".venv" / "bin" / "python"
    return str(own) if own is not None and os.access(own, os.X_OK) else sys.executable


def _environment(folder: Path | None) -> Mapping[str, str]:
    before = os.environ.get("PYTHONPATH")
    path = [*map(str, import_path(folder) if folder else ()), *([before] if before else [])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path)} if path else os.environ


def _why(said: str) -> str:
    """Return what a process said last, as a sentence."""
    lines = [each.strip() for each in said.strip().splitlines() if each.strip()]
    if not lines:
        return f"its process ended without a word; {_EXPECTED}"
    if lines[-1].startswith(("- ", "ModuleNotFoundError")) or _MODULE not in lines[-1]:
        return lines[-1].removeprefix("- ")
    return f"its runtime replays no recordings ({lines[-1]}); {_EXPECTED}"


class Answer(msgspec.Struct):
    """Answer of another process, and how many modules the folder gave."""

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
