"""The code of a part of a model: the modules of its classes and what these use, each hashed."""

import sys
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from types import ModuleType

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import Owner


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
    values: Iterable[object] = vars(module).values()
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
