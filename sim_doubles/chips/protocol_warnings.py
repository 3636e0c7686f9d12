"""Warnings about what a host did that the real chip would ignore, refuse or leave undefined."""

import re

KEPT = 100

_NUMBER = r"0x[0-9a-f]+|\d+(\.\d+)?|\b([0-9a-f]{2}( |\b))+"
"""Numbers, and bytes as hex digits: they may differ between two warnings of one kind."""


class ProtocolWarnings(list[str]):
    """The first hundred warnings of one chip, and the first of each kind however late it comes.

    They are sentences; two that differ in numbers only are of one kind. `total` counts all.
    """

    def __init__(self, chip: str) -> None:
        super().__init__()
        self.chip = chip
        self.total = 0
        self._kinds: set[str] = set()

    def note(self, sentence: str) -> None:
        """Keep one warning: what was done, and what the real chip makes of it."""
        self.total += 1
        if len(self) < KEPT or self._is_new(sentence):
            self.append(f"{self.chip}: {sentence}")
            self._kinds.add(_kind(sentence))

    def _is_new(self, sentence: str) -> bool:
        return _kind(sentence) not in self._kinds


def _kind(sentence: str) -> str:
    return re.sub(_NUMBER, "#", sentence)
