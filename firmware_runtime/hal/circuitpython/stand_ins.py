"""Modules that drivers import and a machine that is no Raspberry Pi does not have.

While `StandIns` is in force, each name of `MODULES` imports a module of this folder where none is
installed, or where it is Blinka's, which does not import on a machine it does not know. A
`board.py` of the user's own is left alone.
"""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Final, Self

from firmware_runtime.system.resources import Closing

_HERE: Final = "firmware_runtime.hal.circuitpython"
MODULES: Final = {
    name: f"{_HERE}.{name}" for name in ("board", "busio", "digitalio", "micropython", "pwmio")
}
"""What is imported under whose name."""


class StandIns(Closing, MetaPathFinder):
    """Finds a stand-in for each of `modules` from `install` to `remove`; a context manager.

    With `keep_blinka` Blinka's own modules are imported where it is installed.
    """

    def __init__(self, modules: Mapping[str, str] = MODULES, *, keep_blinka: bool = False) -> None:
        self._modules = modules
        self._keep_blinka = keep_blinka

    def install(self) -> None:
        """Be asked first from now on."""
        sys.meta_path.insert(0, self)

    def remove(self) -> None:
        """Find nothing any more, and let those found be looked for again."""
        if self in sys.meta_path:
            sys.meta_path.remove(self)
        for name, ours in self._modules.items():
            if sys.modules.get(name) is sys.modules.get(ours, self):
                del sys.modules[name]

    def close(self) -> None:
        """Do as `remove` does."""
        self.remove()

    def __enter__(self) -> Self:
        self.install()
        return self

    def find_spec(
        self,
        name: str,
        path: Sequence[str] | None,  # noqa: ARG002 -- none of ours is within a package
        target: ModuleType | None = None,  # noqa: ARG002 -- a reload gives the same
    ) -> ModuleSpec | None:
        """The stand-in for that name; None for any other, and where the real one is to be had."""
        if name not in self._modules or self._is_to_be_had(name):
            return None
        return ModuleSpec(name, _Renamed(self._modules[name]))

    def _is_to_be_had(self, name: str) -> bool:
        real = PathFinder.find_spec(name)
        if real is None:
            return False
        return self._keep_blinka or not _is_blinka(real)


class _Renamed(Loader):
    """Gives a module of ours under another name."""

    def __init__(self, ours: str) -> None:
        self._ours = ours

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:  # noqa: ARG002
        module = import_module(self._ours)
        self._own_spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module its own name back; it is loaded."""
        module.__spec__ = self._own_spec


def _is_blinka(spec: ModuleSpec) -> bool:
    """Return whether a module lies beside the package adafruit_blinka."""
    if spec.origin is None:
        return False
    folder = Path(spec.origin).parent
    return any((each / "adafruit_blinka").is_dir() for each in (folder, folder.parent))
