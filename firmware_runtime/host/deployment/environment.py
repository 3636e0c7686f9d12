"""The content of a virtual environment for a target, laid out here.

A wheel is an archive whose files have fixed places, and an environment is a folder with a
`pyvenv.cfg`: neither takes the target's Python, but for bytecode, which is that of a minor version.
It is made here where there is a Python of that version, else there. There is no pip in it.
"""

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from hashlib import sha256
from pathlib import Path, PurePosixPath
from zipfile import BadZipFile

from installer import install
from installer.destinations import SchemeDictionaryDestination
from installer.exceptions import InstallerError
from installer.sources import WheelFile

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.needed_wheels import needed
from firmware_runtime.host.deployment.target import Target
from firmware_runtime.host.deployment.wheels import EXTRAS
from firmware_runtime.system.programs import ProgramFailed, answer_of

_DIGITS = 7
"""Hexadecimal digits of a sum that make up a file's time."""


def lay_out(wheelhouse: Path, ours: Sequence[Path], target: Target, into: Path, place: str) -> None:
    """Unpack our wheels, and those they need, as an environment that the target has at `place`.

    Raises DeploymentError.
    """
    site = into / "lib" / f"python{target.minor_version}" / "site-packages"
    scheme = {"purelib": site, "platlib": site, "headers": into / "include"}
    scheme |= {"scripts": into / "bin", "data": into}
    destination = SchemeDictionaryDestination(
        {name: str(folder) for name, folder in scheme.items()},
        interpreter=f"{place}/bin/python",
        script_kind="posix",
        overwrite_existing=True,
    )
    for wheel in needed(wheelhouse.iterdir(), ours, EXTRAS, target):
        try:
            with WheelFile.open(wheel) as source:
                install(source, destination, {"INSTALLER": b"firmware-runtime\n"})
        except (InstallerError, BadZipFile, ValueError, KeyError, OSError) as error:
            raise DeploymentError(error, where=wheel.name, expected="a wheel") from error
    (into / "pyvenv.cfg").write_text(
        f"home = {PurePosixPath(target.base).parent}\n"
        "include-system-site-packages = true\n"
        f"version = {target.python}\n"
        f"executable = {target.base}\n"
    )


def compile_bytecode(content: Path, target: Target, link: str) -> bool:
    """Compile all modules, if there is a Python here that makes the target's bytecode.

    They are compiled as below the link to the program in use, so that the next version's are equal.
    """
    python = _python_for(target)
    if python is None:
        return False
    seal(content)  # bytecode holds its source's time
    words = [python, "-I", "-m", "compileall", "-qq", "-s", str(content), "-p", link]
    with suppress(ProgramFailed):  # a template among the modules has none
        answer_of([*words, str(content / "lib")])
    return True


def _python_for(target: Target) -> str | None:
    asked = "import importlib.util; print(importlib.util.MAGIC_NUMBER.hex())"
    for python in _pythons(f"python{target.minor_version}"):
        with suppress(ProgramFailed):  # a name that leads to nothing
            if answer_of([python, "-I", "-c", asked], timeout_s=10.0).strip() == target.magic:
                return python
    return None


def _pythons(name: str) -> Iterator[str]:
    yield sys.executable
    for folder in os.get_exec_path():
        if (found := Path(folder, name)).is_file():
            yield str(found)


def seal(content: Path) -> str:
    """Return the list of all files with their sums, as sha256sum prints them.

    The time of each is made of its sum: rsync takes a file of the same size and time for the same.
    """
    lines = []
    for file in sorted(each for each in content.rglob("*") if each.is_file()):
        digest = sha256(file.read_bytes()).hexdigest()
        at = int(digest[:_DIGITS], 16)
        os.utime(file, (at, at))
        lines.append(f"{digest}  ./{file.relative_to(content).as_posix()}\n")
    return "".join(lines)
