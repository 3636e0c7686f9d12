"""An environment of an interpreter with the project in it, from wheels alone."""

import hashlib
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import Final

from tests.machines.interpreters import Interpreter
from tests.vm.commands import run

PROJECT: Final = Path(__file__).parents[2]
BOARDS: Final = (PROJECT / "examples/balancing",)
"""Packages with boards of their own, installed beside the project."""
SOURCE_ONLY: Final = "sdnotify"
"""A dependency that is published as source only; pure Python, so its wheel fits everywhere."""
_GLIBCS: Final = ("manylinux_2_28", "manylinux_2_27", "manylinux_2_17", "manylinux2014")


def wheels_of_the_project(folder: Path) -> list[Path]:
    """The project as it is now, and boards beside it, as wheels."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.whl"):
        old.unlink()
    _remove(PROJECT / "build/lib")  # else removed modules come along
    _pip("wheel", "--no-deps", "--wheel-dir", folder, PROJECT, *BOARDS)
    return sorted(folder.glob("*.whl"))


def environment_of(interpreter: Interpreter, folder: Path, wheels: Sequence[Path]) -> Path:
    """The program of an environment with these wheels and what they need."""
    home = folder.absolute() / interpreter.name
    site = home / "lib" / f"python{interpreter.minor}" / "site-packages"
    project = next(wheel for wheel in wheels if wheel.name.startswith("firmware_runtime-"))
    _install_dependencies(interpreter, site, project)
    target = _target(interpreter)
    _pip("install", "--no-deps", "--upgrade", "--target", site, *target, *wheels)
    (home / "pyvenv.cfg").write_text(
        f"home = {interpreter.home}\nversion = {interpreter.version}\n", encoding="utf-8"
    )
    program = home / "bin" / "python"
    program.parent.mkdir(exist_ok=True)
    program.write_text(_script(interpreter), encoding="utf-8")
    program.chmod(0o755)
    return program


def _script(interpreter: Interpreter) -> str:
    """A program that starts the interpreter as itself."""
    words = ['"$0"' if word == "$0" else quote(word) for word in interpreter.command]
    return f'#!/bin/bash\n{interpreter.variables} exec {" ".join(words)} "$@"\n'


def _install_dependencies(interpreter: Interpreter, site: Path, project: Path) -> None:
    """What the project needs, once for each state of pyproject.toml."""
    stated = hashlib.sha256((PROJECT / "pyproject.toml").read_bytes()).hexdigest()
    mark = site.parent / "dependencies"
    if mark.exists() and mark.read_text(encoding="ascii") == stated:
        return
    _remove(site)
    wheels, target = site.parent / "wheels", _target(interpreter)
    _pip("wheel", "--no-deps", "--wheel-dir", wheels, SOURCE_ONLY)
    _pip("install", "--find-links", wheels, "--target", site, *target, project)
    mark.write_text(stated, encoding="ascii")


def _target(interpreter: Interpreter) -> list[str]:
    """Options by which pip installs for another interpreter than its own."""
    platforms = [f"--platform={glibc}_{interpreter.machine}" for glibc in _GLIBCS]
    version = f"--python-version={interpreter.minor}"
    return [version, "--implementation=cp", "--only-binary=:all:", *platforms]


def _pip(*words: object) -> None:
    run(sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *words)


def _remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
