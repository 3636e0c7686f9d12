"""Header of a statistics file: what a run states before it begins, and what is overdue by it.

The loop may never come to what is due, so readers count it. The file has the deadline of each
model's next activation, and when its numbers were written. From that a reader knows the present
instant of a run that is under way, however long the loop has been stuck, and the last one of a run
whose process is gone.

- While the process lives, an activation that is due waits for its turn, as long as its model's next
  one is not due too. Of two, one has not run: it counts as skipped, as the loop will count it. A
  model that is still within its period waits with that one's later phases: what falls due before
  they are over is skipped. But where the policy is to catch up, all of them wait: each will run.
- When the process is gone without having ended the run, nothing waits any more: what was due while
  it lived has been skipped. It lived when it wrote last, and when the guard last saw it, which may
  be long after in a run that hung.
- A run that has ended has counted this itself, and nothing after the instant at which it is to end
  belongs to it, however late the loop comes there.
"""

from collections.abc import Mapping
from enum import IntEnum
from math import isfinite
from time import monotonic_ns
from typing import Annotated, Any, Final, TypeAlias

from msgspec import Meta, Struct, convert, to_builtins
from msgspec.structs import replace

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import (
    ELAPSED,
    GUARD,
    HEARTBEAT,
    MODEL,
    STATE,
    WRITTEN,
    Layout,
)
from firmware_runtime.statistics.mapped_file import Kind, ReadableFile
from firmware_runtime.system.this_process import ProcessIdentity

NOT_ASKED: Final = "not asked for"
NOTHING_TO_WAIT_FOR: Final = "virtual time waits for nothing"
SETTINGS: Final = "settings"
"""The key of a header's conditions that holds the requested system settings."""


class Request(Struct, frozen=True):
    """One setting requested from the operating system; `reason` says why it was refused."""

    asked: Any
    """A number, a truth value or a list of numbers, as JSON has it."""
    granted: bool
    reason: str | None

    @property
    def is_refused(self) -> bool:
        """True if it was really requested and not granted."""
        return not self.granted and self.reason not in {NOT_ASKED, NOTHING_TO_WAIT_FOR}


Settings: TypeAlias = dict[str, Request]
"""By the setting's name."""


class _Asked(Struct, frozen=True):
    """Requested settings in a header's conditions; none in the statistics of old runs."""

    settings: Settings = {}


class RunFigures(Struct, frozen=True, omit_defaults=True):
    """State of a run: how far it has come, or how it ended."""

    state: str
    """A `RunState` in small letters, or `died`: its process is gone without a last state."""
    reason: str | None
    """How the run ended, in a sentence."""
    complete: bool
    """False if the process died while it wrote, so that the last step's numbers may be in part."""
    elapsed_s: float
    steps: int
    inputs_dropped: int
    overloaded_s: float | None
    """When it gave up its real-time priority for lack of time."""
    armed: bool
    guarded: bool
    cpu_s: float | None
    began_ns: int | None = None
    """The system's time at its start, ns since 1970; not of a run in virtual time."""


class Conditions(Struct, frozen=True):
    """Conditions that must agree if numbers of two runs are to be compared."""

    stated: dict[str, Any]
    """Every condition by name but `settings`: kernel, machine, board; values as JSON has them."""
    settings: Settings
    run: RunFigures

    def text(self, name: str) -> str | None:
        """A stated condition in words; None where there is no such one, or it is not known."""
        value = self.stated.get(name)
        return None if value is None else str(value)

    @property
    def is_virtual(self) -> bool:
        """True if the run was in virtual time: nothing can be late then, nothing takes time."""
        return self.stated.get("clock") == "VirtualClock"

    @property
    def refused(self) -> Settings:
        """System settings that were requested and not granted."""
        return {name: each for name, each in self.settings.items() if each.is_refused}

    def as_json(self) -> dict[str, object]:
        """One table, as other programs know it."""
        return {**self.stated, **to_builtins({SETTINGS: self.settings, "run": self.run})}


def conditions_of(stated: Mapping[str, object], run: RunFigures, yielded_ns: int = 0) -> Conditions:
    """A header's conditions, less the priority that the run gave up at `yielded_ns`; 0: never."""
    asked, others = settings_of(stated), dict(stated)
    others.pop(SETTINGS, None)
    settings = settings_after(asked, yielded_ns)
    if settings is not asked:
        others |= {"scheduler": "SCHED_OTHER", "scheduler_priority": 0}
    return Conditions(others, settings, run)


def settings_of(stated: Mapping[str, object]) -> Settings:
    """The requested system settings. Raises ValidationError, a ValueError, where it is no such."""
    return convert(stated, _Asked).settings


def settings_after(settings: Settings, yielded_ns: int) -> Settings:
    """The settings that hold once the run gave up its priority; 0: it never did."""
    fifo = settings.get("fifo_priority")
    if yielded_ns == 0 or fifo is None or not fifo.granted:
        return settings
    reason = f"given up after {yielded_ns / SECOND:.1f} s: overload"
    return {**settings, "fifo_priority": replace(fifo, granted=False, reason=reason)}


STATISTICS = Kind("statistics file", b"FWRTSTAT", 2)


class RunState(IntEnum):
    """State of a run: how far it has come, and how it ended."""

    RUNNING = 0
    ENDED = 1
    STOPPED = 2
    FAILED = 3
    OVERRUN = 4


class StatedModel(Struct, frozen=True):
    """Period, tolerance and policy of one model; one without a period has events."""

    period_ns: Annotated[int, Meta(gt=0)] | None
    tolerance_ns: int
    policy: str | None
    kind: str = ""


class Saved(Struct, frozen=True):
    """State of the writer when a copy was made."""

    writer_alive: bool
    complete: bool


class Driver(Struct, frozen=True):
    """The part of a header that identifies the process: the guard needs no more."""

    writer: ProcessIdentity
    conditions: dict[str, Any]
    saved: Saved | None = None

    @property
    def has_outputs(self) -> bool:
        """True if outputs outside its own process are switched off at its end."""
        return "switched_off" in self.conditions


def driver_of(file: ReadableFile) -> Driver:
    """Return which process writes a statistics file, and the conditions of its run.

    Raises StatisticsFileError when its header states neither, or nothing that can be.
    """
    return file.header_as(Driver)


class Header(Driver, frozen=True, kw_only=True):
    """The whole header, typed.

    `clock_speed` is how fast the run's clock goes, 0 for virtual time; None where what is due is
    not to be counted. `until_ns` is the instant at which the run is to end.
    """

    layout: Layout
    models: dict[str, StatedModel]
    clock_speed: float | None = None
    until_ns: int = NEVER
    began: tuple[int, int] | None = None
    """CLOCK_MONOTONIC and the system's time at the start, ns."""

    def __post_init__(self) -> None:
        """Refuse what cannot be used. Raises ValueError."""
        if not isfinite(self.clock_speed or 0):
            raise ValueError(f"clock_speed: {self.clock_speed}, expected a finite number")
        if missing := set(self.layout.models) - self.models.keys():
            raise ValueError(f"models: no entry for {', '.join(sorted(missing))}")
        settings_of(self.conditions)

    @property
    def board(self) -> str | None:
        """The name of the board, where it has one."""
        board = self.conditions.get("board")
        return None if board is None else str(board)

    def as_json(self) -> dict[str, object]:
        """As the file carries it, with the place of every number."""
        table = {**to_builtins(self), "layout": self.layout.describe()}
        return {name: value for name, value in table.items() if value is not None}


_SCHEDULED, _SKIPPED, _DUE, _IS_IN_PERIOD = map(
    MODEL.index, ("scheduled", "skipped", "due_ns", "is_in_period")
)


def count_overdue(cells: Cells, header: Header, *, is_alive: bool) -> None:
    """Add what is overdue to a copy of a run's cells, with the instant up to which it is."""
    speed = header.clock_speed
    written_at = max(cells[WRITTEN], cells[HEARTBEAT])
    if speed is None or cells[STATE] != 0 or written_at == 0:
        return
    alive_at = monotonic_ns() if is_alive else max(cells[GUARD], written_at)
    cells[ELAPSED] += max(round((alive_at - written_at) * speed), 0)
    cells[WRITTEN] = alive_at
    now = _last_instant(cells, header)
    for index, path in enumerate(header.layout.models):
        first, stated = header.layout.model(index), header.models[path]
        due = cells[first + _DUE]
        if due > now:
            continue
        if is_alive:
            number = _dropped(now - due, stated, is_in_period=cells[first + _IS_IN_PERIOD] != 0)
        else:
            number = due_since(now - due, stated)
        cells[first + _SCHEDULED] += number
        cells[first + _SKIPPED] += number


def waiting(cells: Cells, header: Header, index: int) -> int:
    """Return how many activations of a model are due and wait, of cells that were read."""
    first, now = header.layout.model(index), _last_instant(cells, header)
    due, is_in_period = cells[first + _DUE], cells[first + _IS_IN_PERIOD] != 0
    if header.clock_speed is None or cells[STATE] != 0 or due > now:
        return 0
    stated = header.models[header.layout.models[index]]
    dropped = _dropped(now - due, stated, is_in_period=is_in_period)
    return due_since(now - due, stated) - dropped


def _last_instant(cells: Cells, header: Header) -> int:
    """The present instant, or the last one of the run if that is over by the clock."""
    return min(cells[ELAPSED], header.until_ns)


def due_since(ago: int, stated: StatedModel) -> int:
    """Return how many deadlines there have been, if the first was so long ago, ns."""
    period = stated.period_ns
    return 1 if period is None else ago // period + 1


def _dropped(ago: int, stated: StatedModel, *, is_in_period: bool) -> int:
    """Return how many of them will not run any more, while the process lives."""
    if stated.policy != "skip" or stated.period_ns is None:
        return 0
    missed = -(-ago // stated.period_ns)
    return missed if is_in_period else max(missed - 1, 0)
