"""Writes a package of one's own: a folder of real files is copied, and words in it are replaced.

A robot is a copy of the project's example `examples/pan_tilt`, which `robot_template` links to; so
what is written is tested as it stands. A chip's template is filled in from its register table.
"""

import keyword
import re
import sys
from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from importlib.util import find_spec
from pathlib import Path

from firmware_runtime.board.installed import names
from firmware_runtime.errors import ConfigError

PLACE = "firmware_runtime.host.scaffold"
EXAMPLE = "pan_tilt"
_NAME = re.compile(r"[a-z][a-z0-9_]{0,31}")
_EXPECTED = "expected small letters, digits and _, a letter first, 32 at most"
_TAKEN = frozenset({"build", "dist", "docs", "test", "tests"})
"""Folders that the package, or building it, has beside it."""
_BUILT = ("__pycache__", "build", ".egg-info")
"""Folders that Python or an installation leaves in an example."""


def write_robot(name: str, folder: Path) -> list[Path]:
    """Write a robot's package into a folder; return its files.

    Raises ConfigError for a name that a package or a board cannot have, and for a folder with
    something in it.
    """
    taken = f"{name!r}: a board of that name is installed; expected another name"
    fault = taken if name in names() else name_fault(name)
    if fault is not None:
        raise ConfigError.of_one("new robot", fault)
    title = class_name(EXAMPLE)
    words = dict.fromkeys((EXAMPLE, EXAMPLE.replace("_", "-")), name)
    return write_package("robot_template", folder, {**words, title: class_name(name)})


def name_fault(name: str) -> str | None:
    """Return why a package cannot have this name, in a sentence; None if it can.

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
    """Return the name as a class has it: `two_wheels` is `TwoWheels`."""
    return "".join(word.capitalize() for word in name.split("_"))


def write_package(template: str, folder: Path, words: Mapping[str, str]) -> list[Path]:
    """Write a template into a folder that is empty or not there; return the files in order.

    `words` maps each word of the template, in the names of files and in what they hold, to what
    stands for it. Raises ConfigError if the folder has something in it or cannot be written.
    """
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise ConfigError.of_one(str(folder), "is there already", expected="an empty folder")
        return [
            _write(folder / _replaced(path, words), _replaced(text, words))
            for path, text in sorted(_texts(files(PLACE) / template))
        ]
    except OSError as error:
        raise ConfigError.of_one(str(folder), f"cannot be written ({error.strerror})") from error


def _texts(folder: Traversable, below: str = "") -> Iterator[tuple[str, str]]:
    """Yield every file of a template with its path in it; what tools leave there is none of it."""
    for each in folder.iterdir():
        if each.is_file():
            yield below + each.name, each.read_text(encoding="utf-8")
        elif not each.name.startswith(".") and not each.name.endswith(_BUILT):
            yield from _texts(each, f"{below}{each.name}/")


def _write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def _replaced(text: str, words: Mapping[str, str]) -> str:
    for word, value in words.items():
        text = text.replace(word, value)
    return text
