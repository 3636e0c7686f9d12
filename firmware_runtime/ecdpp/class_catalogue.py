"""The atomic classes that model files may name, as installed packages make them known.

An entry point of the group `firmware_runtime.ma_classes` leads to an `AtomicClass`, or to a class
derived from `Atomic`, which has the entry point's name; or to a mapping of such by their names. An
entry point that is called as a board of its package has that board's classes: the files in the
board's own folder know them, no others.

Every class is known as `PACKAGE:Class` to every file.
"""

import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.ecdpp.atomic_class import AtomicClass
from firmware_runtime.errors import ConfigError, SettingError, text_of
from firmware_runtime.system.packages import of_every_package

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP: Final = "firmware_runtime.ma_classes"
BOARDS: Final = "firmware_runtime.boards"
_NONE: Final[Mapping[str, AtomicClass]] = MappingProxyType({})


class KnownClasses(dict[str, AtomicClass]):
    """Classes by name. `missing` says of each package that breaks the contract how: it adds none.

    `clashes` has the whole names of those that several packages call alike. A model that names
    none of these has nothing to do with either.
    """

    def __init__(
        self,
        classes: Mapping[str, AtomicClass],
        missing: Sequence[str] = (),
        clashes: Mapping[str, Sequence[str]] = MappingProxyType({}),
    ) -> None:
        super().__init__(classes)
        self.missing = tuple(missing)
        self.clashes = dict(clashes)


class _Registered(NamedTuple):
    """A class of a package; `folder` is that of its board, whose files alone know it by name."""

    package: str
    name: str
    atomic_class: AtomicClass
    folder: Path | None

    @property
    def whole_name(self) -> str:
        """What every file may call it."""
        return f"{self.package}:{self.name}"

    def is_known_to(self, file: Path | None) -> bool:
        """Whether this file may call it by its name alone."""
        if self.folder is None:
            return True
        return file is not None and file.resolve().is_relative_to(self.folder)


def known_classes(own: Mapping[str, AtomicClass] = _NONE, file: Path | None = None) -> KnownClasses:
    """Every class that is installed, as a file may call it; `own` go before them."""
    registered, missing = _installed_classes()
    by_name: defaultdict[str, list[_Registered]] = defaultdict(list)
    for each in registered:
        if each.is_known_to(file):
            by_name[each.name.casefold()].append(each)
    classes = dict(own)
    clashes: dict[str, Sequence[str]] = {}
    for name, found in by_name.items():
        if len(found) > 1:
            clashes[name] = [each.whole_name for each in found]
        elif name not in {each.casefold() for each in own}:
            classes[found[0].name] = found[0].atomic_class
    classes |= {each.whole_name: each.atomic_class for each in registered}
    return KnownClasses(classes, missing, clashes)


@cache
def _installed_classes() -> tuple[Sequence[_Registered], Sequence[str]]:
    """All of them, and what is wrong with packages that add none."""
    found: list[_Registered] = []
    missing: list[str] = []
    boards = {(package, each.name) for package, each in of_every_package(BOARDS)}
    for package, entry_point in of_every_package(GROUP):
        is_of_board = (package, entry_point.name) in boards
        try:
            classes = list(_classes_of(entry_point, package))
        except ConfigError as error:
            missing.append(str(error))
            continue
        folder = _folder_of(entry_point) if is_of_board else None
        found += [_Registered(package, name, each, folder) for name, each in classes]
    return found, missing


def _folder_of(entry_point: "EntryPoint") -> Path | None:
    file = getattr(sys.modules[entry_point.module], "__file__", None)
    return None if file is None else Path(file).resolve().parent


def _classes_of(entry_point: "EntryPoint", whose: str) -> Iterator[tuple[str, AtomicClass]]:
    """The classes that an entry point leads to. Raises ConfigError for anything else."""
    where = f"ma_classes {entry_point.name} of the package {whose}"
    try:
        loaded = entry_point.load()
    except (Exception, SystemExit) as error:
        fault = f"{type(error).__name__}: {text_of(error)}"
        raise ConfigError.of_one(where, fault) from error
    if not isinstance(loaded, Mapping):
        loaded = {entry_point.name: loaded}
    for name, each in loaded.items():
        try:
            yield name, _atomic_class(each)
        except SettingError as error:
            raise ConfigError.of_one(where, str(error)) from error


def _atomic_class(found: object) -> AtomicClass:
    if isinstance(found, AtomicClass):
        return found
    if isinstance(found, type) and issubclass(found, Atomic):
        return AtomicClass.of(found)
    raise SettingError("expected an AtomicClass or a class derived from Atomic", where=f"{found!r}")
