"""What has been heard since the last section was written, in lists by kind.

The lists stay the same objects for as long as a run lasts: whatever hears something keeps one, not
its `append`, since CPython does `list.append(value)` without a call. Within a step nothing else is
done.
"""

from typing import Any, Final

from firmware_runtime.blackbox.section import Kind
from firmware_runtime.devs.heard_ports import Sent

_STEP: Final = Kind.STEP.value


class Heard:
    """Lists as in `section.Section`; `fields` are these and all else of one, in its order."""

    __slots__ = (
        *("enabled", "entered", "fields", "readings", "sent", "times", "transfers", "world"),
    )

    def __init__(self) -> None:
        self.readings: list[int] = []
        self.times: list[int] = []
        self.enabled: list[bool] = []
        self.world: list[int] = []
        self.sent: Sent = []
        self.transfers: list[tuple[Any, ...]] = []
        self.entered: list[tuple[str, Any]] = []
        lists = self.readings, self.times, self.enabled, self.world
        self.fields: list[Any] = [_STEP, 0, *lists, self.sent, self.transfers, self.entered, None]
        """What is encoded, a section without making one: of a step, if nothing else is said."""

    def __bool__(self) -> bool:
        return any(self.fields[2:-1])

    def clear(self) -> None:
        """Forget everything: it has been written."""
        self.readings.clear()
        self.sent.clear()
        self.transfers.clear()
        if self.enabled:  # seldom: asking takes less time than clearing
            self.enabled.clear()
        if self.times:
            self.times.clear()
        if self.world:
            self.world.clear()
        if self.entered:
            self.entered.clear()
