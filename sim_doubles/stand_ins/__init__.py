"""Modules of a Raspberry Pi that drivers import, for a machine that is none.

While `StandIns` is in force, each name of `MODULES` imports a module that speaks to doubles where
none is installed, or where it is Blinka's, which does not import on a machine it does not know. A
`board.py` of the user's own is left alone.
"""

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Final

MODULES: Final = {
    "smbus": "sim_doubles.smbus",
    "busio": "sim_doubles.busio",
    "board": "sim_doubles.stand_ins.board",
    "digitalio": "sim_doubles.stand_ins.digitalio",
    "micropython": "sim_doubles.stand_ins.micropython",
    "pwmio": "sim_doubles.stand_ins.pwmio",
}
"""What is imported under whose name."""


class StandIns(MetaPathFinder):
    """Finds a stand-in for each of `MODULES` from `install` to `remove`.

    With `keep_blinka` Blinka's own modules are imported where it is installed.
    """

    def __init__(self, *, keep_blinka: bool = False) -> None:
        self._keep_blinka = keep_blinka

    def install(self) -> None:
        """Be asked first from now on."""
        sys.meta_path.insert(0, self)

    def remove(self) -> None:
        """Find nothing any more, and let those found be looked for again."""
        if self in sys.meta_path:
            sys.meta_path.remove(self)
        for name, ours in MODULES.items():
            if sys.modules.get(name) is sys.modules.get(ours, self):
                del sys.modules[name]

    def find_spec(
        self,
        name: str,
        path: Sequence[str] | None,  # noqa: ARG002 -- none of ours is within a package
        target: ModuleType | None = None,  # noqa: ARG002 -- a reload gives the same
    ) -> ModuleSpec | None:
        """The stand-in for that name; None for any other, and where the real one is to be had."""
        if name not in MODULES or self._is_to_be_had(name):
            return None
        return ModuleSpec(name, _Renamed(MODULES[name]))

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
    """Whether a module lies beside the package adafruit_blinka."""
    if spec.origin is None:
        return False
    folder = Path(spec.origin).parent
    return any((each / "adafruit_blinka").is_dir() for each in (folder, folder.parent))
