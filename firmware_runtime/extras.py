"""What an extra of this project installs, as a command that works in the environment it runs in.

The project is on no package index, so its own name cannot be installed from one, and installing
its folder would replace an editable installation. What the extra lists is on the index.
"""

import shlex
import sys
from importlib import import_module


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
