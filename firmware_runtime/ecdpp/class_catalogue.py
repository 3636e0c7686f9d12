"""The atomic classes that model files may name, as installed packages make them known.

An entry point of the group `firmware_runtime.ma_classes` leads to an `AtomicClass`, or to a class
derived from `Atomic`, which has the entry point's name; or to a mapping of such by their names.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.ecdpp.atomic_class import AtomicClass
from firmware_runtime.entry_points import installed
from firmware_runtime.errors import ConfigError, SettingError, text_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "firmware_runtime.ma_classes"
_NONE: Final[Mapping[str, AtomicClass]] = MappingProxyType({})


class KnownClasses(dict[str, AtomicClass]):
    """Classes by name. `missing` says of each package that breaks the contract how: it adds none.

    A model that names none of its classes has nothing to do with it.
    """

    def __init__(self, classes: Mapping[str, AtomicClass], missing: Sequence[str]) -> None:
        super().__init__(classes)
        self.missing = tuple(missing)


def known_classes(own: Mapping[str, AtomicClass] = _NONE) -> KnownClasses:
    """Every class that is installed, by name; `own` go before them.

    Raises ConfigError for two classes of one name.
    """
    installed_ones = _installed_classes()
    return KnownClasses({**installed_ones, **own}, installed_ones.missing)


@cache
def _installed_classes() -> KnownClasses:
    found: dict[str, AtomicClass] = {}
    missing: list[str] = []
    packages: dict[str, str] = {}
    for entry_point in installed(GROUP):
        whose = "?" if entry_point.dist is None else entry_point.dist.name
        try:
            classes = list(_classes_of(entry_point, whose))
        except ConfigError as error:
            missing.append(str(error))
            continue
        for name, atomic_class in classes:
            if name.casefold() in packages:
                other = packages[name.casefold()]
                fault = f"{other} and {whose} both have a class {name}; expected one of them"
                raise ConfigError.of_one("model files", fault)
            packages[name.casefold()] = whose
            found[name] = atomic_class
    return KnownClasses(found, missing)


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
    raise SettingError(f"{found!r}: expected an AtomicClass or a class derived from Atomic")
