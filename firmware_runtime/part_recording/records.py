"""What a recording consists of: a header, then batches of records in order of occurrence.

Instants are ns of logical time since the start of the run. `visit` says which advance to that
instant it was, from 0; `round` which round of it. `name` is a place in the header's lists.
"""

from typing import Any, Final, TypeAlias

from msgspec import Struct

from firmware_runtime.recording.header import RecordedBoard

FORMAT: Final = 2


class Header(RecordedBoard, frozen=True, kw_only=True):
    """What was recorded; the code is that of the part."""

    format: int
    role: str
    """The part's role: `controller` unless another was recorded."""
    components: list[str]
    entering: dict[str, str]
    """Type by name of what enters the part."""
    crossings: list[str]
    """Of each of these, the component's port at which it crosses the cut, as a link names it."""
    positions: list[int]
    """Of each of these, how many atomics of the part were declared before its sender."""
    leaving: dict[str, str]
    shown: str | None = None
    """The port whose values `Shown` records hold, if there is one."""


class Entered(Struct, array_like=True, tag="in", frozen=True):
    """A value that entered the part."""

    at: int
    visit: int
    round: int
    name: int
    age: int | None
    """Ns since it left its model, where it came over a link and that is known."""
    value: Any
    """As `values.plain` makes it."""


class Left(Struct, array_like=True, tag="out", frozen=True):
    """A value that left the part: an output event."""

    at: int
    visit: int
    round: int
    name: int
    value: Any


class Retuned(Struct, array_like=True, tag="retuned", frozen=True):
    """Gains and limits that were changed after an instant; `visit` -1: before the first."""

    at: int
    visit: int
    settings: Any


class Postponed(Struct, array_like=True, tag="postponed", frozen=True):
    """An event of a model of the part that was late, and put off by its policy."""

    at: int
    visit: int
    path: str
    until: int


class State(Struct, array_like=True, tag="state", frozen=True):
    """Fields of the part's atomics that have another value than before, after a visit."""

    at: int
    visit: int
    fields: dict[str, bytes]


class Shown(Struct, array_like=True, tag="shown", frozen=True):
    """A value of the port that a person wants to see over time; no part of any comparison."""

    at: int
    value: float


class Ended(Struct, array_like=True, tag="ended", frozen=True):
    """The end of the run: the last instant worked off, and how many records there were."""

    at: int
    visit: int
    state: str
    reason: str
    records: int
    """Records before this one, those included that were dropped."""


Record: TypeAlias = Entered | Left | Retuned | Postponed | State | Shown | Ended


class Batch(Struct, array_like=True, frozen=True):
    """The records of one step or several; `first` counts all records before, dropped or not."""

    first: int
    records: list[Record]
