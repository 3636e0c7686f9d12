"""Header of a recording, as far as it is of the board: settings, code and versions.

The code of a part of a model is the modules of its classes and what these use, each hashed.
"""

import sys
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any, Final, TypeAlias

from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import Owner
from firmware_runtime.errors import legible
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.system.conditions import versions_here


def code_of(atomics: Iterable[Atomic]) -> dict[str, str]:
    """SHA-256 by module of the source of these models' classes, and of what those modules use.

    Modules of other packages are left out: their versions are recorded. So is a module without a
    source file.
    """
    first = {module for atomic in atomics for module in _modules_of(atomic)}
    packages = {name.partition(".")[0] for name in first}
    found: dict[str, str] = {}
    waiting = sorted(first)
    while waiting:
        name = waiting.pop()
        module = sys.modules.get(name)
        if name in found or module is None or name.partition(".")[0] not in packages:
            continue
        if (hashed := _hash(module)) is not None:
            found[name] = hashed
            waiting += sorted(_used_by(module))
    return dict(sorted(found.items()))


def changed_modules(before: Mapping[str, str], code: Mapping[str, str]) -> list[str]:
    """Modules whose source is another than it was, in order of their names."""
    names = before.keys() | code.keys()
    return sorted(name for name in names if before.get(name) != code.get(name))


def digest_of(code: Mapping[str, str]) -> str:
    """SHA-256 over modules and their hashes."""
    lines = (f"{name} {digest}\n" for name, digest in sorted(code.items()))
    return sha256("".join(lines).encode()).hexdigest()


def packages_used(modules: Iterable[str]) -> frozenset[str]:
    """The packages of these modules and of what their names come from, Python's own left out."""
    found = [sys.modules[name] for name in modules if name in sys.modules]
    names = {each.__name__ for each in found}.union(*map(_used_by, found))
    return frozenset(name.partition(".")[0] for name in names) - sys.stdlib_module_names


def _modules_of(atomic: Atomic) -> Iterator[str]:
    """The modules of a model's class, and of the coupled models that it is in, below the root.

    Those of Python itself, such as `typing` of a generic class, are left out: its version is known.
    """
    within: Owner = atomic
    while within.parent is not None:
        for kind in type(within).__mro__:
            if kind.__module__.partition(".")[0] not in sys.stdlib_module_names:
                yield kind.__module__
        within = within.parent


def _used_by(module: ModuleType) -> set[str]:
    """The modules that a module's names come from."""
    values: Iterable[Any] = vars(module).values()
    names = {
        each.__name__ if isinstance(each, ModuleType) else getattr(each, "__module__", None)
        for each in values
    }
    return {name for name in names if isinstance(name, str)}


def _hash(module: ModuleType) -> str | None:
    source = getattr(module, "__file__", None)
    if source is None or not source.endswith(".py"):
        return None
    try:
        return sha256(Path(source).read_bytes()).hexdigest()
    except OSError:
        return None


class RecordedBoard(Struct, frozen=True, kw_only=True):
    """Header of a recording, as far as it is of the board, its settings and its code."""

    board: str
    """The board's own name."""
    kind: str
    fingerprint: str
    """SHA-256 over the board's file and the overrides."""
    source: str
    """The file that the settings came from."""
    table: dict[str, Any]
    """The board's settings, overrides included."""
    clock: str
    code: dict[str, str]
    """SHA-256 by module of the source of the recorded models' classes."""
    code_sha256: str
    """SHA-256 over those."""
    versions: dict[str, str | None]
    """Versions of Python, the kernel and packages."""


def recorded_board(board: Board, atomics: Iterable[Atomic], clock: Clock) -> RecordedBoard:
    """Return the header of a recording of these models."""
    code = code_of(atomics)
    return RecordedBoard(
        board=board.name,
        kind=board.kind,
        fingerprint=board.fingerprint,
        source=legible(str(board.source)),
        table=dict(board.table),
        clock=type(clock).__name__,
        code=code,
        code_sha256=digest_of(code),
        versions=versions_here(),
    )


Versions: TypeAlias = Mapping[str, str | None]
_APART: Final = {"kernel"}
"""Names of versions that compute nothing."""


def changed_versions(recorded: Versions) -> dict[str, dict[str, str | None]]:
    """By name, what was in the run (`recorded`) and what is `here`, where these differ.

    A package that was not looked for then is left out; None is one that is not installed.
    """
    here = versions_here()
    return {
        name: {"recorded": version, "here": here.get(name)}
        for name, version in recorded.items()
        if name not in _APART and version != here.get(name)
    }


def versions_said(changed: Mapping[str, Versions]) -> str:
    """All of them in a row: the name, what it was in the run, what it is here."""
    return ", ".join(
        f"{name} {each['recorded'] or 'none'} (here {each['here'] or 'none'})"
        for name, each in changed.items()
    )
