"""What a run is given besides its model and its clock: settings, and hooks."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from msgspec import Struct, field

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.executive.account import Step
from firmware_runtime.executive.deadlines import PathDeadline
from firmware_runtime.executive.inbox import Source
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.process import ProcessSettings


class Hook(Protocol):
    """Called between the steps of a run: arming, the service's notices, the journal.

    By the loop when a step is over, at least every 50 ms, and at an instant that one has asked for
    (`Executive.poll_by`).
    """

    def between_steps(self, now: int, left: int) -> None:
        """Do what cannot wait; and what can, if it fits into the `left` ns to the next event."""


class Tap(Protocol):
    """What notes all that enters a run from the world, in order, and where it begins and ends.

    The loop calls it; what it does is its own (`blackbox`). A run without one costs nothing.
    """

    def watch(self, step: Step) -> None:
        """Note what the clock says in the steps of a run, of which this is the one under way."""

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """What to call for a model; for one of the robot's own that is what it was."""

    def begin(self, at: int) -> None:
        """A step for instant `at` begins."""

    def end(self, at: int, next_at: int) -> None:
        """The step has ended without an error and is counted; the next one is for `next_at`."""

    def entered(self, port: InPort[object], value: object) -> None:
        """A value for an input port of the root is about to enter the step that has begun."""

    def go_on(self, until: int) -> None:
        """The run begins or goes on, to instant `until`."""

    def arm(self, *, armed: bool) -> None:
        """Outputs may be driven from now on, or may not."""

    def exit(self, exit_models: Callable[[], list[Exception]]) -> list[Exception]:
        """Call the models' exit; return what that returns."""

    def finish(self, outcome: Outcome, at: int) -> None:
        """The run is over, with its outputs made safe, at instant `at`."""


class Device(Protocol):
    """The time one device has had a bus for, in ns."""

    @property
    def busy_ns(self) -> int:
        """Grows only."""


class Bus(Device, Protocol):
    """What is read of a bus; `hal.accounted_bus.AccountedBus` has it."""

    name: str
    transactions: int
    bytes: int
    errors: int
    retries: int

    @property
    def by_address(self) -> Mapping[int, Device]:
        """The same by device; a device joins when it is first spoken to."""


class Port(Protocol):
    """What is read of a serial port; `hal.accounted_port.AccountedPort` has it."""

    name: str
    writes: int
    bytes_written: int
    bytes_read: int
    errors: int
    writing_ns: int
    reading_ns: int


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
