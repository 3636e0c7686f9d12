"""MODULE:NAME: a model of any module, or what a class or function there makes of arguments."""

import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, replace
from importlib import import_module
from typing import TYPE_CHECKING

from firmware_runtime.devs.component import Component
from firmware_runtime.errors import (
    ConfigError,
    FirmwareRuntimeError,
    did_you_mean,
    expected_one_of,
    text_of,
)

if TYPE_CHECKING:
    from firmware_runtime.models.qss import System


def named_model(word: str, arguments: Mapping[str, object], about: str) -> "Component | System":
    """The model that a module has, or that a class or function of it makes. Raises ConfigError."""
    from firmware_runtime.models.qss import System  # noqa: PLC0415 -- a board's start needs none

    module, _, name = word.partition(":")
    if not (module and name):
        missing = "object" if module else "module"
        raise ConfigError.of_one(word, f"it names no {missing}", expected=about)
    kinds = Component | System
    sys.path.insert(0, "")  # a user's module lies where the user is
    try:
        found = _named(word, about)
        if isinstance(found, System) and arguments:
            made: object = _changed(word, found, arguments)
        elif isinstance(found, kinds):
            made = _unchanged(word, found, arguments)
        else:
            made = _called(word, found, arguments, about)
    except FirmwareRuntimeError:
        raise
    except (Exception, SystemExit) as error:
        fault = f"{type(error).__name__}: {text_of(error)}"
        raise ConfigError.of_one(word, fault, expected=about) from error
    finally:
        sys.path.remove("")
    if not isinstance(made, kinds):
        raise ConfigError.of_one(word, f"it makes {type(made).__name__}", expected=about)
    return made


def _named(word: str, about: str) -> object:
    """The object of a module. Raises ConfigError for one that it has not."""
    module, _, name = word.partition(":")
    loaded = import_module(module)
    if not hasattr(loaded, name):
        fault = f"{module} has no {name}{did_you_mean(name, vars(loaded))}"
        raise ConfigError.of_one(word, fault, expected=about)
    found: object = getattr(loaded, name)
    return found


def _changed(word: str, system: "System", arguments: Mapping[str, object]) -> object:
    """The system with these fields. Raises ConfigError for those that it has not."""
    if faults := list(_unknown(arguments, (each.name for each in fields(system)))):
        raise ConfigError(word, faults)
    return replace(system, **arguments)  # type: ignore[arg-type] # of its fields


def _unchanged(word: str, model: object, arguments: Mapping[str, object]) -> object:
    """The model itself. Raises ConfigError for arguments, which it cannot take any more."""
    if arguments:
        expected = "a class, or a function that makes one"
        raise ConfigError.of_one(word, "--set: it is a model already", expected=expected)
    return model


def _called(word: str, make: object, stated: Mapping[str, object], about: str) -> object:
    """What a class or function makes of these arguments; one called `name` need not be stated.

    Raises ConfigError for arguments that it does not take, and for those that it lacks.
    """
    from inspect import Parameter, signature  # noqa: PLC0415 -- of models that no board has

    if not callable(make):
        raise ConfigError.of_one(word, f"{type(make).__name__} is not callable", expected=about)
    taken = signature(make).parameters
    arguments = dict(stated)
    if "name" in taken and taken["name"].default is Parameter.empty:
        arguments.setdefault("name", word.partition(":")[2].lower())
    is_open = any(each.kind is Parameter.VAR_KEYWORD for each in taken.values())
    variable = {Parameter.VAR_KEYWORD, Parameter.VAR_POSITIONAL}
    named = {name: each for name, each in taken.items() if each.kind not in variable}
    faults = [] if is_open else list(_unknown(arguments, named))
    faults += [
        f"{name}: not stated; expected --set {name}=VALUE"
        for name, each in named.items()
        if each.default is Parameter.empty and name not in arguments
    ]
    if faults:
        raise ConfigError(word, faults)
    return make(**arguments)


def _unknown(arguments: Iterable[str], known: Iterable[str]) -> Iterator[str]:
    """A sentence for each argument that is none of those known."""
    names = list(known)
    for name in arguments:
        if name not in names:
            yield f"--set {name}: no such argument; {expected_one_of(name, names)}"
