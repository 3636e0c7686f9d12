"""What has been recorded since the last section was written, in lists by kind.

The lists stay the same objects for as long as a run lasts: each tap keeps one, not its `append`,
since CPython does `list.append(value)` without a call. Within a step nothing else is done.
"""

from typing import Any, Final

from firmware_runtime.devs.ports import Sent
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.recording.classes import NotedClasses

AT: Final = 1
"""Place of the instant among the fields of a section."""
EXTRA: Final = -1
"""Place of what a section says beside its lists."""
NO_STEP: Final = -1
"""In the place of the instant of a step, between two steps."""
_STEP: Final = Kind.STEP.value


class Pending:
    """Lists as in `section.Section`; `fields` are these and all else of one, in its order."""

    __slots__ = (
        *("classes", "enabled", "entered", "fields", "lists", "readings", "sent", "times"),
        *("transfers", "world"),
    )

    def __init__(self) -> None:
        self.readings: list[int] = []
        self.times: list[int] = []
        self.enabled: list[bool] = []
        self.world: list[int] = []
        self.sent: Sent = []
        self.transfers: list[tuple[Any, ...]] = []
        self.entered: list[tuple[str, Any]] = []
        self.classes = NotedClasses(self.sent)
        self.lists = (
            *(self.readings, self.times, self.enabled, self.world),
            *(self.sent, self.transfers, self.entered),
        )
        self.fields: list[Any] = [_STEP, NO_STEP, *self.lists, None]
        """What is encoded when a step is over, a section without making one."""

    def __bool__(self) -> bool:
        return any(self.lists)

    @property
    def step_at(self) -> int:
        """Instant of the step that has not been written; NO_STEP: there is none."""
        at: int = self.fields[AT]
        return at

    def clear(self) -> None:
        """Forget everything: it has been written."""
        self.fields[AT] = NO_STEP
        for each in (*self.lists, self.classes.unlike):
            each.clear()
