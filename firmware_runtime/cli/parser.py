"""A parser whose errors are sentences, and which loads nothing that `argparse` could do without."""

import argparse
import os
import re
import sys
from functools import cache
from typing import Any, NoReturn

from firmware_runtime.errors import Status, expected_one_of

_ARGUMENT = "argument "
"""What argparse begins with where it names an option."""
_NUMBERS = {"int": "a whole number", "float": "a number"}
"""What argparse calls the types that a verb takes as they are, and what they are."""
_CHOICE = r"invalid choice: '(.*)' \(choose from (.*)\)$"


@cache
def _columns() -> int:
    """How wide the terminal is; 80 where there is none."""
    stated = os.environ.get("COLUMNS", "")
    if stated.isdecimal() and int(stated) > 0:
        return int(stated)
    try:
        return os.get_terminal_size(sys.__stdout__.fileno()).columns or 80  # type: ignore[union-attr]
    except (AttributeError, ValueError, OSError):
        return 80


class _Formatter(argparse.HelpFormatter):
    """As argparse's, which loads `shutil` for the width each time an argument is added."""

    def __init__(self, *arguments: Any, **options: Any) -> None:  # noqa: ANN401 -- as argparse has it
        super().__init__(*arguments, **{"width": _columns() - 2, **options})


class Parser(argparse.ArgumentParser):
    """Like argparse's, and so are those of its verbs."""

    def __init__(self, *arguments: Any, **options: Any) -> None:  # noqa: ANN401 -- as argparse has it
        super().__init__(*arguments, **{"formatter_class": _Formatter, **options})

    def error(self, message: str) -> NoReturn:
        """Print what is wrong, with what was probably meant and what was expected; exit with 2.

        A value that is none is a sentence; a word too many or too few is shown with the usage.
        """
        found = re.search(_CHOICE, message)
        if found is not None:
            word, choices = found[1], re.findall(r"[^\s',]+", found[2])
            message = f"{message[: found.start()]}'{word}': {expected_one_of(word, choices)}"
        for kind, expected in _NUMBERS.items():
            message = re.sub(
                rf"invalid {kind} value: ('.*')$", rf"\1: expected {expected}", message
            )
        if message.startswith(_ARGUMENT):
            self.refuse(message.removeprefix(_ARGUMENT))
        super().error(message)

    def refuse(self, sentence: str) -> NoReturn:
        """Print one sentence on what is wrong; exit with 2."""
        self.exit(Status.BAD_INPUT, f"{self.prog}: {sentence}\n")
