"""What has been heard since the last section was written, in lists by kind.

The lists stay the same objects for as long as a run lasts: whoever hears something keeps the
`append` of one. Within a step nothing else is done.
"""

from array import array
from typing import Any


class Heard:
    """Lists as in `section.Section`."""

    __slots__ = ("enabled", "entered", "readings", "sent", "times", "transfers", "world")

    def __init__(self) -> None:
        self.readings: array[int] = array("q")
        self.times: list[int] = []
        self.enabled: list[bool] = []
        self.world: list[int] = []
        self.sent: list[tuple[int, Any]] = []
        self.transfers: list[tuple[Any, ...]] = []
        self.entered: list[tuple[str, Any]] = []

    def __bool__(self) -> bool:
        return bool(
            self.readings
            or self.transfers
            or self.times
            or self.enabled
            or self.world
            or self.sent
            or self.entered
        )

    def clear(self) -> None:
        """Forget everything: it has been written."""
        del self.readings[:]
        self.sent.clear()
        self.transfers.clear()
        self.times.clear()
        self.enabled.clear()
        self.world.clear()
        self.entered.clear()
