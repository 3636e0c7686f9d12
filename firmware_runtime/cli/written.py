"""A text that a verb has made, into a file or to the screen."""

import os
from collections.abc import Collection, Mapping
from pathlib import Path

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.atomic_file import keep_output, why_not_writable


def check_output(output: Path, suffixes: Collection[str], option: str = "-o") -> None:
    """Raise ConfigError for a file of no known kind, or in no folder that takes it."""
    if output.suffix not in suffixes:
        fault = f"{output}: expected a name that ends in {' or '.join(suffixes)}"
        raise ConfigError(option, [fault])
    if output.is_dir() or not os.access(output.parent, os.W_OK):
        fault = f"{output}: no file that can be written; expected a name in a folder that takes one"
        raise ConfigError(option, [fault])


def check_page_file(output: Path, option: str = "-o") -> None:
    """Raise ConfigError where no page can be written, before there is one: `view/page_file.py`."""
    from firmware_runtime.view.page_file import ENDINGS, page_file_faults  # noqa: PLC0415 -- of few

    check_output(output, ENDINGS, option)
    if faults := page_file_faults(output):
        raise ConfigError(option, faults)


def check_files(verb: str, files: Mapping[str, Path | None]) -> None:
    """Raise ConfigError for files that cannot be written, by the options that name them."""
    faults = [
        f"{option} {path}: cannot be written ({why}); expected a file that can be written"
        for option, path in files.items()
        if path is not None and (why := why_not_writable(path)) is not None
    ]
    if len(faults) == 1:
        raise ConfigError.of_one(verb, faults[0])
    if faults:
        raise ConfigError(verb, faults)


def check_test_file(test: Path, *beside: str) -> None:
    """Raise ConfigError for what cannot be a test's file, and for what would be written over.

    `beside` has the endings of files of the same name that are written too.
    """
    where = f"--as-test {test}"
    if test.suffix != ".py" or not test.stem.isidentifier():
        raise ConfigError.of_one(where, "expected the name of a module, such as test_that_day.py")
    for each in (test, *map(test.with_suffix, beside)):
        if each.exists():
            raise ConfigError.of_one(where, f"{each} is there already", expected="another name")
    if not test.absolute().parent.is_dir():
        raise ConfigError.of_one(where, f"expected a folder {test.parent}")


def write_text(text: str, output: Path | None) -> None:
    """Write it whole and print where; without a place print the text. Raises ConfigError."""
    if output is None:
        print(text, end="")
        return
    keep_output(output, text.encode())
    print(output)
