"""Programs of the system that an installation runs: each is shown, and each failure explained."""

import os
import re
import shlex
import sys
import sysconfig
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import firmware_runtime
from firmware_runtime.errors import InstallationRefused, StepFailed
from firmware_runtime.host.installation.places import PROGRAM
from firmware_runtime.system.programs import ProgramFailed, answer_of

Words = Sequence[str]


def run(words: Words, log: Callable[[str], None]) -> None:
    """Show a command and run it to its end. Raises StepFailed."""
    log(f"$ {shlex.join(words)}")
    answer(words)


def answer(words: Words) -> str:
    """What a command prints. Raises StepFailed."""
    try:
        return answer_of(words)
    except ProgramFailed as error:
        raise StepFailed(str(error)) from error


HIDDEN = ("/home", "/root", "/run/user", "/tmp", "/var/tmp")  # noqa: S108 -- nothing is put there
"""What ProtectHome= and PrivateTmp= hide."""
_PLAIN = re.compile(r"/[A-Za-z0-9_.+@%/-]+")
_REMEDY = f"install it into {Path(PROGRAM).parents[1]}, or name another program with --program PATH"


def own_program(package: Path) -> str:
    """The installed program of this interpreter; `package` is a file of the board's package.

    Raises InstallationRefused, also if that package is one that a service would not see.
    """
    program = Path(sysconfig.get_path("scripts"), "firmware-runtime")
    python, runtime = Path(sys.executable).resolve(), Path(firmware_runtime.__file__)
    refuse_hidden([program, python, runtime, package])
    return runnable(str(program))


def runnable(program: str) -> str:
    """This program, which is there and can be run. Raises InstallationRefused."""
    if not os.access(program, os.X_OK):
        raise InstallationRefused(f"is no program that can be run; {_REMEDY}", where=program)
    return checked(program)


def checked(program: str) -> str:
    """This program, whose path can stand in a unit. Raises InstallationRefused."""
    if _PLAIN.fullmatch(program) is None:
        raise InstallationRefused(
            "cannot stand in a unit",
            where=f"{program!r}",
            expected="an absolute path without spaces",
        )
    refuse_hidden([Path(program)])
    return program


def refuse_hidden(parts: Iterable[Path]) -> None:
    """Raise InstallationRefused if a service would not see one of these."""
    for part in parts:
        for hidden in HIDDEN:
            if part.is_relative_to(hidden):
                raise InstallationRefused(
                    f"lies below {hidden}, which is hidden from a service; {_REMEDY}", where=part
                )
