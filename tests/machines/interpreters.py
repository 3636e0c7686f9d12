"""CPythons of this computer, and those of Debian roots for it and for another processor.

Each is an environment with the project in it, known by one program: `FOLDER/bin/python`. What a
foreign processor's needs is in that program, a script, and it is its own `sys.executable`, so a
process that it starts is of the same kind.
"""

import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Final

from tests.machines.roots import Root, root_of

OLDEST: Final = 11
SUITES: Final = ("bookworm", "trixie", "forky")
EMULATED: Final = "aarch64"
EMULATOR: Final = f"qemu-{EMULATED}-static"
_ROOTS: Final = tuple(product(SUITES, dict.fromkeys((platform.machine(), EMULATED))))
_NO_FUSED: Final = "glibc.cpu.hwcaps=-FMA,-FMA_Usable,-FMA4,-AVX2,-AVX2_Usable"
_VERSION: Final = "import platform; print(platform.python_version())"


@dataclass(frozen=True)
class Interpreter:
    """A CPython that the project is to be installed for."""

    name: str
    version: str
    """Such as 3.11.7."""
    machine: str
    home: Path
    """The folder of its program, which an environment names as its own."""
    command: tuple[str, ...]
    """What starts it, for the shell's `exec`; `$0` is the environment's program."""
    variables: str = ""
    """Set for it, as the shell writes it."""

    @property
    def minor(self) -> str:
        """Such as 3.11."""
        return self.version.rpartition(".")[0]


def interpreters(folder: Path, words: Sequence[str]) -> Iterator[Interpreter | str]:
    """All that can be had here; for each that cannot, why, in a sentence.

    With words only those that have one of them in their name.
    """
    own = list(_of_this_computer())
    if own and platform.machine() == "x86_64":
        own.append(_without_fused(own[0]))
    yield from (each for each in own if _is_wanted(each.name, words))
    for suite, machine in _ROOTS:
        is_own = suite == SUITES[0] and machine == platform.machine()  # near to this computer's own
        if not is_own and _is_wanted(f"{machine}-{suite}", words):
            yield _of_root(suite, machine, folder)


def _is_wanted(name: str, words: Sequence[str]) -> bool:
    return not words or any(word in name for word in words)


def _of_this_computer() -> Iterator[Interpreter]:
    """CPythons on the path and those of pyenv, one of each minor version."""
    for minor in range(OLDEST, 31):
        program = next(_programs(minor), None)
        if program is not None:
            version = _answer([program, "-c", _VERSION])
            home = Path(_answer([program, "-c", "import sys; print(sys._base_executable)"])).parent
            name = f"cpython-{version}-{platform.machine()}"
            command = ("-a", "$0", str(home / f"python3.{minor}"))
            yield Interpreter(name, version, platform.machine(), home, command)


def _programs(minor: int) -> Iterator[str]:
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found = [shutil.which(f"python3.{minor}"), *pyenv.glob(f"3.{minor}.*/bin/python3.{minor}")]
    if sys.version_info[:2] == (3, minor):
        found.insert(0, sys.executable)
    for program in map(str, filter(None, found)):
        said = subprocess.run(
            [program, "-c", _VERSION], capture_output=True, text=True, check=False
        ).stdout.strip()
        if re.fullmatch(rf"3\.{minor}\.\d+", said):  # no alpha, and no shim without a Python
            yield program


def _without_fused(interpreter: Interpreter) -> Interpreter:
    """The same, with the functions that glibc has for processors without fused multiply-add."""
    variables = f"GLIBC_TUNABLES={_NO_FUSED}"
    return replace(interpreter, name=f"{interpreter.name}-no-fma", variables=variables)


def _of_root(suite: str, machine: str, folder: Path) -> Interpreter | str:
    """The CPython of a Debian suite for a processor."""
    is_emulated = machine != platform.machine()
    if is_emulated and shutil.which(EMULATOR) is None:
        return f"Debian {suite} on {machine}: needs apt install qemu-user-static"
    if shutil.which("mmdebstrap") is None:
        return f"Debian {suite} on {machine}: needs apt install mmdebstrap"
    root = root_of(suite, machine, folder)
    if isinstance(root, str):
        return f"Debian {suite} on {machine}: {root}"
    command = _emulated(root) if is_emulated else _by_its_own_loader(root)
    version = _answer([*command, "-c", _VERSION])
    name = f"cpython-{version}-{machine}-{suite}"
    at = 1 + command.index("-0" if is_emulated else "--argv0")
    named = (*command[:at], "$0", *command[at + 1 :])
    return Interpreter(name, version, machine, root.python.parent, named)


def _emulated(root: Root) -> tuple[str, ...]:
    return (EMULATOR, "-0", str(root.python), "-L", str(root.folder), str(root.python))


def _by_its_own_loader(root: Root) -> tuple[str, ...]:
    libraries = ("--library-path", str(root.libraries))
    return (str(root.loader), "--argv0", str(root.python), *libraries, str(root.python))


def _answer(command: Sequence[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.strip()
