"""Base of every hardware model that moves something: interlock, polling, stopping, bring-up again.

Whatever goes wrong begins with a stop, and a stop is written again until the chip acknowledges it.
What follows is the same for all: a chip that lost its settings is brought up again; while the
interlock disables outputs, a model that keeps its command waits and checks it periodically.

A subclass says how to stop (`write_stop`) and what it does while all is well (`settle`, `drive_on`,
`external`). It writes inside `try` and hands every HalError to `fail`.

What it applies of its commands leaves at the port `applied`, whenever that changes: controllers go
by it (`firmware_runtime.models.motion`).
"""

from abc import abstractmethod
from collections.abc import Callable, Iterable
from typing import TypeVar

from firmware_drivers.chips.step import Step
from firmware_drivers.hardware import HardwareModel
from firmware_runtime.devs.ports import InPort, Takes
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.hal.budget import Line
from firmware_runtime.hal.interlock import POLL_PERIOD, Interlock, always_enabled
from firmware_runtime.hal.wire_errors import HalError, NotReady
from firmware_runtime.models.motion import Applied

T = TypeVar("T")

STOP_AGAIN_AFTER = 50 * MILLISECOND
"""Ns until a stop that was not acknowledged is written again."""
POLL_EVERY = SECOND
"""Ns between two polls of a chip that drives: one that was reset acknowledges writes all the same.
"""


class Actuator(HardwareModel):
    """Drives while the interlock allows it; all phases but the subclass's own are here.

    bring_up (the steps' waits) --> the subclass's own;  failed --fault!--> bring_up (RETRY_AFTER)
    own phases, stopped --> reporting (0) --fault!--> the first of these that applies:
        the stop was not acknowledged --> stopping (STOP_AGAIN_AFTER) --> stopped --> reporting
        the chip lost its settings --> bring_up
        disabled by the interlock --> disabled (POLL_PERIOD) --> the same, or resumed
        none --> the subclass's own, by `settle`
    hold_applying --> applying (0), if what is applied has changed --applied!--> that phase
    report_refused --> applying (0) --fault!--> the phase that it was in, for what was left of it
    """

    drives = True
    """Outputs are driven by it: a robot with such a component has to have a `stop`."""

    def __init__(
        self,
        name: str,
        bring_up: Callable[[], Iterable[Step]],
        line: Line,
        interlock: Interlock = always_enabled,
    ) -> None:
        super().__init__(name, bring_up, line)
        self.applied_out = self.out_port("applied", Applied)
        self.applied = Applied.NOTHING
        """Part of its commands that it applies now."""
        self._applied_sent: Applied | None = None
        self._held: tuple[str, int] | None = None
        """The phase that `applying` leads to, and its duration."""
        self.interlock = interlock
        self.is_stop_due = False
        """The last stop was not acknowledged, and nothing was written since."""
        self.is_bring_up_due = False
        self.since_poll = 0
        """Ns of driving since the chip was polled; a subclass that polls counts it."""
        self._is_disabled = False

    def in_port(self, name: str, type_: type[T], *, takes: Takes = "any") -> InPort[T]:
        """Declare an input port: a command that is no number arrives, for it stops an actuator.

        The subclass reports it as a fault, also while outputs are disabled: see `report_refused`.
        """
        return super().in_port(name, type_, takes=takes)

    # What a subclass knows ------------------------------------------------------------------------

    @abstractmethod
    def write_stop(self) -> None:
        """Write a stop that is right in any state of the chip. Raises HalError."""

    @abstractmethod
    def settle(self) -> None:
        """Enter the phase of one's own that the command leads to: nothing else is due."""

    @abstractmethod
    def drive_on(self) -> None:
        """Go on from a phase of one's own whose time advance ran out."""

    def resume(self) -> None:
        """Go on from `disabled`: the interlock enables outputs again."""
        self.settle()

    def poll(self) -> None:
        """Check that the chip still is as brought up. Raises NotReady if it is not."""

    def lost_settings(self, error: HalError) -> bool:
        """Return whether the chip has to be brought up again after this error."""
        return isinstance(error, NotReady)

    def unready(self) -> str | None:
        """Return the reason against enabling outputs, in a few words; None if there is none.

        A chip that failed and then acknowledged the stop answers again. More cannot be known of it
        while outputs are disabled.
        """
        if self.phase.startswith("bring_up") or self.is_stop_due:
            return super().unready()
        return None

    def failed_uses(self) -> int:
        """Return 0: the end of the run itself reports what could not be stopped."""
        return 0

    # The DEVS functions ---------------------------------------------------------------------------

    def output(self) -> None:
        """Send the faults noted since the last time, and what is applied where that is new."""
        if self.faults:
            super().output()
        if self.applied is not self._applied_sent:
            self.applied_out.send(self.applied)

    def internal(self) -> None:
        """Go on; what is applied has been sent."""
        self._applied_sent = self.applied
        if self.phase.startswith("bring_up"):
            super().internal()
        else:
            self.faults.clear()
            self.proceed()

    def begin(self) -> None:
        """The chip is up, and its outputs are off."""
        self.is_stop_due = self.is_bring_up_due = False
        self.since_poll = 0
        self.settle()

    def proceed(self) -> None:
        """Do what is due: stop again, check the interlock, or drive on."""
        if self.phase == "reporting":
            self._settle()
        elif self.phase == "stopping":
            self.stop()
        elif self.phase == "applying" and self._held is not None:
            self.hold_in(*self._held)
        elif self.phase != "disabled":
            self.drive_on()
        elif self.interlock():
            self._is_disabled = False
            self.resume()
        else:
            self.hold_disabled()

    def exit(self) -> None:
        """Leave everything stopped."""
        self.write_stop()

    # Verbs of a subclass --------------------------------------------------------------------------

    def poll_if_due(self) -> None:
        """Poll the chip if it has driven for POLL_EVERY. Raises HalError."""
        if self.since_poll >= POLL_EVERY:
            self.since_poll = 0
            self.poll()

    def stop(self) -> None:
        """Write a stop, and report; it is repeated until it is acknowledged."""
        self.applied = Applied.NOTHING
        try:
            self.write_stop()
        except HalError as error:
            self.is_stop_due = True
            self.is_bring_up_due |= self.lost_settings(error)
            self.note(error)
        else:
            self.is_stop_due = False
        self.activate("reporting")

    def fail(self, error: HalError) -> None:
        """Report an error and stop; the next command that is written is followed by a poll."""
        self.note(error)
        self.since_poll = POLL_EVERY
        self.is_bring_up_due |= self.lost_settings(error)
        self.stop()

    def disable(self) -> None:
        """Stop because the interlock says so, then wait for it in `disabled`."""
        self._is_disabled = True
        self.stop()

    def report_refused(self, error: FirmwareRuntimeError, elapsed: int) -> None:
        """Report a command that is none where there is nothing to stop, and go on as it was."""
        self.note(error)
        self.continue_(elapsed)
        if self.phase != "applying":
            self._held = self.phase, self.sigma
        self.activate("applying")

    def hold_disabled(self) -> None:
        """Wait, stopped as it is, and check the interlock again after POLL_PERIOD."""
        self.hold_in("disabled", POLL_PERIOD)

    def note_success(self, applied: Applied = Applied.ALL) -> None:
        """Take in that the chip acknowledged a command, or how much of it: faults are over."""
        if self._consecutive_faults > 0 or not self._has_worked:
            self.consecutive_faults = 0
        self.is_stop_due = False
        self.applied = applied

    def hold_applying(self, phase: str, duration: int) -> None:
        """Stay in a phase for `duration` ns; first send what is applied, if that has changed."""
        if self.applied is self._applied_sent:
            self.hold_in(phase, duration)
        else:
            self._held = phase, duration
            self.activate("applying")

    # ----------------------------------------------------------------------------------------------

    def _settle(self) -> None:
        if self.is_stop_due:
            self.hold_in("stopping", STOP_AGAIN_AFTER)
        elif self.is_bring_up_due:
            self.bring_up_again()
        elif self._is_disabled:
            self.hold_disabled()
        else:
            self.settle()
