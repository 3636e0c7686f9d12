"""Trying one chip out: reading it again and again, or moving it for a while and then off."""

from collections.abc import Callable, Iterable
from typing import Protocol

from firmware_drivers.catalogue.trial import Actuator, Reading, Sensor
from firmware_drivers.chips.step import Step
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.outcome import SwitchOffRetry
from firmware_runtime.hal.wire_errors import HalError, NotReady

KEEP_SWITCHING_OFF = 2 * SECOND
ATTEMPTS = 5
"""Bring-ups of a chip that is not ready before that counts as a failure."""
AGAIN_AFTER = SECOND // 10
"""Ns until a chip that failed is brought up again."""

Show = Callable[[int, Reading], None]
"""Shows a reading, taken so many ns after the start."""
Log = Callable[[str], None]


class Pace(Protocol):
    """Time, and a user who may want to stop."""

    def now(self) -> int:
        """The present instant, ns."""

    def wait(self, span: int) -> bool:
        """Let ns pass; return at once, and True, when it is time to stop."""


class Watch:
    """Reads one sensor again and again; what fails is reported, and the chip brought up again."""

    def __init__(self, sensor: Sensor, pace: Pace, show: Show, log: Log) -> None:
        self._sensor = sensor
        self._pace = pace
        self._show = show
        self._log = log
        self.values = 0
        """Count of readings that had a value."""

    def run(self, every: int, span: int | None) -> None:
        """Read every so many ns, for `span` ns or until stopped.

        Raises the HalError of the first bring-up: nothing answers, or another chip.
        """
        try:
            stopped = self._first_bring_up()
            for warning in self._sensor.warnings:
                self._log(warning)
            begun_at = self._pace.now()
            until = NEVER if span is None else begun_at + span
            while not stopped:
                next_at = self._pace.now() + every
                stopped = self._read(begun_at) or next_at > until or self._wait_until(next_at)
        finally:
            self._end()

    def _first_bring_up(self) -> bool:
        """Return whether it was stopped. A chip that is not ready is given a few attempts."""
        for _ in range(ATTEMPTS - 1):
            try:
                return take(self._sensor.bring_up(), self._pace)
            except NotReady as error:
                self._log(str(error))
            if self._pace.wait(AGAIN_AFTER):
                return True
        return take(self._sensor.bring_up(), self._pace)

    def _read(self, begun_at: int) -> bool:
        try:
            if take(self._sensor.measure(), self._pace):
                return True
            self._show(self._pace.now() - begun_at, self._sensor.read())
        except HalError as error:
            self._log(str(error))
            return self._bring_up_again()
        self.values += 1
        return False

    def _bring_up_again(self) -> bool:
        if self._pace.wait(AGAIN_AFTER):
            return True
        try:
            return take(self._sensor.bring_up(), self._pace)
        except HalError as error:
            self._log(str(error))
            return False

    def _wait_until(self, at: int) -> bool:
        return self._pace.wait(max(at - self._pace.now(), 0))

    def _end(self) -> None:
        try:
            self._sensor.end()
        except HalError as error:
            self._log(str(error))


def drive(actuator: Actuator, pace: Pace, span: int, show: Show) -> bool:
    """Move for `span` ns; return whether it was stopped before. Raises the HalError of what failed.

    Bringing up before and switching off afterwards, whatever happened, are the caller's part.
    """
    begun_at = pace.now()
    stopped = pace.wait(0)
    while not stopped:
        show(pace.now() - begun_at, actuator.move())
        left = begun_at + span - pace.now()
        if left <= 0:
            return False
        stopped = pace.wait(min(left, actuator.repeat_ns))
    return True


def switch_off(actuator: Actuator) -> list[str]:
    """Switch off, again while that fails, for two seconds; return what failed."""

    def attempt() -> list[str]:
        try:
            actuator.off()
        except HalError as error:
            return [str(error)]
        return []

    def nothing(_now: int) -> None:
        """Between two attempts there is nothing else to do."""

    return SwitchOffRetry(attempt, MonotonicClock(), KEEP_SWITCHING_OFF, nothing).run()


def take(steps: Iterable[Step], pace: Pace) -> bool:
    """Take steps and let their time pass; return whether it is time to stop."""
    return any(_taken(step, pace) for step in steps)


def _taken(step: Step, pace: Pace) -> bool:
    step.action()
    return pace.wait(step.wait_ns)
