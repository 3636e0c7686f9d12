"""The same recordings replayed by another interpreter, of this computer or of an emulated one."""

import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from firmware_runtime.certification.certificate import Certificate, certificate_of

LIMIT_S: Final = 3600.0
"""Longest wait for one interpreter."""


def certified_by(interpreter: str, recordings: Sequence[Path]) -> Certificate:
    """What this interpreter, a command of one or more words, finds; why not, where it does not."""
    words = shlex.split(interpreter)
    if not words or shutil.which(words[0]) is None:
        return _not_run(interpreter, f"{words[0] if words else 'nothing'}: no such program")
    # -P: the package that is installed there, not one in the folder where the command is given
    command = [*words, "-P", "-m", "firmware_runtime.cli", "certify", "--json"]
    try:
        ended = subprocess.run(  # noqa: S603 -- the interpreter that the user names
            [*command, *(str(path.absolute()) for path in recordings)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return _not_run(interpreter, f"it did not end within {LIMIT_S:g} s")
    except OSError as error:
        return _not_run(interpreter, error.strerror or type(error).__name__)
    try:
        return certificate_of(ended.stdout)
    except ValueError:
        lines = ended.stderr.decode(errors="replace").strip().splitlines()
        return _not_run(interpreter, lines[-1] if lines else f"it ended with {ended.returncode}")


def _not_run(interpreter: str, why: str) -> Certificate:
    return Certificate(machines=[], not_run={interpreter: why})
