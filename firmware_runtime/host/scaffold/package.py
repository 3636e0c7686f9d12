"""Writes a package from a template: a folder of real files, in which words are replaced.

A template is any folder of `templates`. Words are replaced in the names of files and in what they
hold, nothing else happens to them; so a template is code that is linted and tested as it stands.
"""

from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from firmware_runtime.errors import ConfigError

PLACE = "firmware_runtime.host.scaffold"


def write_package(template: str, folder: Path, words: Mapping[str, str]) -> list[Path]:
    """Write a template into a folder that is empty or not there; return the files in order.

    `words` maps each word of the template to what stands for it. Raises ConfigError if the folder
    has something in it or cannot be written.
    """
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise ConfigError.of_one(str(folder), "is there already", expected="an empty folder")
        return [
            _write(folder / _replaced(path, words), _replaced(text, words))
            for path, text in sorted(_texts(files(PLACE) / "templates" / template))
        ]
    except OSError as error:
        raise ConfigError.of_one(str(folder), f"cannot be written ({error.strerror})") from error


def _texts(folder: Traversable, below: str = "") -> Iterator[tuple[str, str]]:
    """Every file of a template, by its path in it; what Python compiled is none."""
    for each in folder.iterdir():
        if each.is_dir() and each.name != "__pycache__":
            yield from _texts(each, f"{below}{each.name}/")
        elif each.is_file():
            yield below + each.name, each.read_text(encoding="utf-8")


def _write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def _replaced(text: str, words: Mapping[str, str]) -> str:
    for word, value in words.items():
        text = text.replace(word, value)
    return text
