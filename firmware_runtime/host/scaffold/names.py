"""Which names a new package may have."""

import keyword
import re
import sys
from importlib.util import find_spec

_NAME = re.compile(r"[a-z][a-z0-9_]{0,31}")
_EXPECTED = "expected small letters, digits and _, a letter first, 32 at most"
_TAKEN = frozenset({"build", "dist", "docs", "test", "tests"})
"""Folders that the package, or building it, has beside it."""


def name_fault(name: str) -> str | None:
    """Why a package cannot have this name, in a sentence; None if it can.

    A package of the same name that is installed already would be hidden by the new one.
    """
    if not _NAME.fullmatch(name):
        return f"{name!r}: {_EXPECTED}"
    if keyword.iskeyword(name) or keyword.issoftkeyword(name):
        return f"{name!r}: a keyword of Python; expected another name"
    if name in _TAKEN:
        return f"{name!r}: what a project calls a folder of its own; expected another name"
    if name in sys.stdlib_module_names or find_spec(name) is not None:
        return f"{name!r}: a package of that name is installed; expected another name"
    return None


def class_name(name: str) -> str:
    """The name as a class has it: `two_wheels` is `TwoWheels`."""
    return "".join(word.capitalize() for word in name.split("_"))
