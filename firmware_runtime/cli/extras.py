"""Modules that need an extra: imported when they are asked for, missed in one sentence."""

from importlib import import_module
from types import ModuleType

from firmware_runtime.errors import ConfigError
from firmware_runtime.extras import install_command


def module_of_extra(name: str, extra: str) -> ModuleType:
    """Import a module of this project. Raises ConfigError, with the command, without the extra."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if error.name is not None and error.name.startswith("firmware_runtime"):
            raise
        raise ConfigError(
            error.name or name,
            [f"not installed; expected the extra {extra}: {install_command(extra)}"],
        ) from error
