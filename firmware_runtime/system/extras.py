"""What an extra of this project installs, as a command that works in the environment it runs in.

The project is on no package index, so its own name cannot be installed from one, and installing
its folder would replace an editable installation. What the extra lists is on the index.
"""

import shlex
import sys
from importlib import import_module
from types import ModuleType

from firmware_runtime.errors import ConfigError


def install_command(extra: str) -> str:
    """Give the command that installs what an extra lists, for the Python that is running."""
    listed = [
        each.partition(";")
        for each in import_module("importlib.metadata").requires("firmware-runtime") or ()
    ]
    wanted = [
        package.strip()
        for package, _, condition in listed
        if f"extra == '{extra}'" in condition.replace('"', "'")
    ]
    return shlex.join([sys.executable, "-m", "pip", "install", *wanted])


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
