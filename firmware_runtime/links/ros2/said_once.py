"""A log that says the same only once: what refuses one message may refuse a thousand a second."""

from collections.abc import Callable
from typing import Final

MOST: Final = 64
"""Different sentences."""


class SaidOnce:
    """Passes each sentence on to `log` the first time, as long as there are not too many."""

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log
        self._said: set[str] = set()

    def __call__(self, sentence: str) -> None:
        """Say it, unless it was said."""
        if sentence not in self._said and len(self._said) < MOST:
            self._said.add(sentence)
            self._log(sentence)
