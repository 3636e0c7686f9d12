"""Under which conditions a run took place, and how far it has come."""

from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from msgspec import Struct, convert, to_builtins
from msgspec.structs import replace

from firmware_runtime.devs.time import SECOND

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
        """Whether it was really requested and not granted."""
        return not self.granted and self.reason not in {NOT_ASKED, NOTHING_TO_WAIT_FOR}


Settings: TypeAlias = dict[str, Request]
"""By the setting's name."""


class _Asked(Struct, frozen=True):
    """What a header's conditions have of it; none in the statistics of old runs."""

    settings: Settings = {}


class RunFigures(Struct, frozen=True, omit_defaults=True):
    """How far a run has come, or how it ended."""

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
    """What must agree if numbers of two runs are to be compared."""

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
        """Whether the run was in virtual time: nothing can be late then, nothing takes time."""
        return self.stated.get("clock") == "VirtualClock"

    @property
    def refused(self) -> Settings:
        """System settings that were requested and not granted."""
        return {name: each for name, each in self.settings.items() if each.is_refused}

    def as_json(self) -> dict[str, Any]:
        """One table, as other programs know it."""
        return {**self.stated, **to_builtins({SETTINGS: self.settings, "run": self.run})}


def conditions_of(stated: Mapping[str, Any], run: RunFigures, yielded_ns: int = 0) -> Conditions:
    """A header's conditions, less the priority that the run gave up at `yielded_ns`; 0: never."""
    settings, others = settings_of(stated), dict(stated)
    others.pop(SETTINGS, None)
    fifo = settings.get("fifo_priority")
    if yielded_ns > 0 and fifo is not None and fifo.granted:
        settings = settings_after(settings, yielded_ns)
        others |= {"scheduler": "SCHED_OTHER", "scheduler_priority": 0}
    return Conditions(others, settings, run)


def settings_of(stated: Mapping[str, Any]) -> Settings:
    """The requested system settings. Raises ValidationError, a ValueError, where it is no such."""
    return convert(stated, _Asked).settings


def settings_after(settings: Settings, yielded_ns: int) -> Settings:
    """The settings that hold once the run gave up its priority; 0: it never did."""
    fifo = settings.get("fifo_priority")
    if yielded_ns == 0 or fifo is None or not fifo.granted:
        return settings
    reason = f"given up after {yielded_ns / SECOND:.1f} s: overload"
    return {**settings, "fifo_priority": replace(fifo, granted=False, reason=reason)}
