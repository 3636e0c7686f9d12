"""What a run is given besides its model and its clock: settings, and hooks."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from msgspec import Struct, field

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.executive.bus_meter import Bus
from firmware_runtime.executive.deadlines import PathDeadline
from firmware_runtime.executive.inbox import Source
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.port_meter import Port
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.executive.tap import Tap


class Hook(Protocol):
    """Called between the steps of a run: arming, the service's notices, the journal.

    By the loop when a step is over, at least every 50 ms, and at an instant that one has asked for
    (`Executive.poll_by`).
    """

    def between_steps(self, now: int, left: int) -> None:
        """Do what cannot wait; and what can, if it fits into the `left` ns to the next event."""


class Configuration(Struct, frozen=True):
    """All of it may be left out: then no setting is requested, and statistics stay in memory."""

    policies: Mapping[str, ActivationPolicy] = field(default_factory=dict)
    """By path of a periodic model, without the root's name; others have policy `skip`."""
    deadlines: Sequence[PathDeadline] = ()
    buses: Sequence[Bus] = ()
    ports: Sequence[Port] = ()
    """Serial ports."""
    sources: Sequence[Source] = ()
    process: ProcessSettings = field(default_factory=ProcessSettings)
    statistics_path: Path | None = None
    switch_off_for: int = SECOND
    """Ns for which outputs are switched off again at the end, where that fails; 0: once."""
    armed_at_start: bool = True
    """Whether outputs may be driven from the start; otherwise a hook arms the run."""
    max_lag: int = 200 * MILLISECOND
    """How long logical time may be behind the clock without catching up, ns of real time."""
    worst: int = 16
    """How many of the worst activations are kept."""
    has_link: bool = False
    """Whether the model is a part, linked to the rest in another process, which is counted."""
    tap: Tap | None = None
    """What notes all that enters the run, in a run that is recorded or replayed."""
    conditions: Mapping[str, Any] = field(default_factory=dict)
    """What else a reader of the statistics should know: board, hash of its file, arguments."""

    def __post_init__(self) -> None:
        """Raise SettingError for policies and deadlines of another type."""
        for path, policy in self.policies.items():
            if not isinstance(policy, ActivationPolicy):
                raise SettingError(f"policy of {path}: {policy!r}", expected="an ActivationPolicy")
        for deadline in self.deadlines:
            if not isinstance(deadline, PathDeadline):
                raise SettingError(f"{deadline!r}", where="deadlines", expected="a PathDeadline")
