"""A parser of the command line that says what a word was probably meant to be."""

import argparse
import re
from typing import NoReturn

from firmware_runtime.spelling import did_you_mean

_CHOICE = re.compile(r"invalid choice: '(.*)' \(choose from (.*)\)$")


class Parser(argparse.ArgumentParser):
    """Like argparse's, and so are those of its verbs."""

    def error(self, message: str) -> NoReturn:
        """Print usage and message, with the choice that is like the wrong one; exit with 2."""
        found = _CHOICE.search(message)
        if found is not None:
            word, choices = found.groups()
            message += did_you_mean(word, re.findall(r"[^\s',]+", choices))
        super().error(message)
