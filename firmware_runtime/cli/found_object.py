"""MODULE:NAME on the command line: an object of a user's module, or what it makes."""

import sys
from importlib import import_module
from typing import TypeVar

from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, text_of

T = TypeVar("T")


def found_object(word: str, kind: type[T], about: str) -> T:
    """The object of this kind that a module has, or that a class or function of it makes.

    Raises ConfigError.
    """
    module_name, _, name = word.partition(":")
    if not (module_name and name):
        missing = "object" if module_name else "module"
        raise ConfigError.of_one(word, f"it names no {missing}", expected=about)
    sys.path.insert(0, "")  # a user's module lies where the user is
    try:
        found = getattr(import_module(module_name), name)
        made: object = found if isinstance(found, kind) else found()
    except FirmwareRuntimeError:
        raise
    except (Exception, SystemExit) as error:
        fault = f"{type(error).__name__}: {text_of(error)}; expected {about}"
        raise ConfigError.of_one(word, fault) from error
    finally:
        sys.path.remove("")
    if not isinstance(made, kind):
        fault = f"it makes {type(made).__name__}; expected {about}"
        raise ConfigError.of_one(word, fault)
    return made
