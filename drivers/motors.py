"""What all motor models share: orders are obeyed, and anything that goes wrong begins with a stop.

A chip that loses its supply, or a bus that fails for a moment, must not leave a vehicle standing
where nothing would ever order it about again: the command is written again once the chip is up. A
chip that fails again and again is given up; then only a new command is obeyed.
"""

from abc import abstractmethod
from collections.abc import Callable, Iterable

from drivers.chips.step import Step
from drivers.hardware import HardwareModel
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.hal.errors import HalError, NotReady
from firmware_runtime.hal.interlock import POLL_PERIOD, Interlock, always_enabled
from firmware_runtime.hal.line_time import Line

CLOCKWISE, COUNTERCLOCKWISE, STILL = 1, 2, 0
"""Motor signals, as in the detective robot's paper."""
STOP_AGAIN_AFTER = 50 * MILLISECOND
"""Ns until a stop that nobody acknowledged is written again."""
FAULTS_BEFORE_FORGETTING = 10
"""Faults in a row after which a command is not written again."""


class Motors(HardwareModel):
    """Writes the newest order, again every `refresh`, and stops when there is none to trust.

    bring_up (the steps' waits) --> still;  a step failed --fault!--> bring_up (RETRY_AFTER)
    still, driving --order?--> obeying (0), written --> reporting (0) --> driving, or still
    driving (refresh) --> written again --> reporting (0) --> driving
    an order refused, or none for order_timeout --> stopped --> reporting (0) --fault!--> still
    the chip silent, or reset --> stopped --> reporting (0) --fault!--> bring_up --> obeying (0)
    the stop not acknowledged --> reporting (0) --fault!--> stopping (STOP_AGAIN_AFTER) --> stopped

    obeying, driving without leave --> stopped --> reporting (0) --> forbidden (POLL_PERIOD)
    forbidden, given leave --> obeying (0)

    A refusal forgets what was ordered, and so do FAULTS_BEFORE_FORGETTING faults in a row. Once an
    order has failed, faults are in a row until the chip has taken two orders one after the other.
    An order that comes while the chip is not up, not stopped yet, or while the interlock
    disables outputs, is kept.
    """

    def __init__(  # noqa: PLR0913 -- chip and line, then how it is driven
        self,
        name: str,
        bring_up: Callable[[], Iterable[Step]],
        line: Line,
        *,
        refresh: int = NEVER,
        order_timeout: int = NEVER,
        interlock: Interlock = always_enabled,
    ) -> None:
        super().__init__(name, bring_up, line)
        self.refresh = refresh
        self.order_timeout = order_timeout
        self.interlock = interlock
        self._has_order = False
        self._refusal: NotReady | None = None
        self._since_order = 0
        self._is_stop_due = False
        self._is_bring_up_due = False
        self._is_forbidden = False
        self._is_repeated = False
        self._has_taken_order = False
        self._is_doubtful = False
        self._faults_in_a_row = 0

    # What a subclass knows ------------------------------------------------------------------------

    @abstractmethod
    def take_order(self) -> None:
        """Read the ports. Raises NotReady for what is no order; that stops the motors."""

    @abstractmethod
    def forget_order(self) -> None:
        """Make standing still what is ordered."""

    @abstractmethod
    def is_moving(self) -> bool:
        """Whether something else than standing still is ordered."""

    @abstractmethod
    def write_order(self) -> None:
        """Write what is ordered to the chip. Raises HalError."""

    @abstractmethod
    def write_stop(self) -> None:
        """Write a stop that is right in any state of the chip. Raises HalError."""

    # The DEVS functions -------------------------------------------------------------------------

    def begin(self) -> None:
        """Obey the order that failed, or a newer one; else stand still."""
        self._is_bring_up_due = False
        if not self._is_doubtful:
            self._faults_in_a_row = 0
        elif self._is_repeated and self._faults_in_a_row >= FAULTS_BEFORE_FORGETTING:
            self._is_repeated = self._has_order = False
            self.forget_order()
        self._settle()

    def proceed(self) -> None:
        """Write what is due: the newest order, the same again, or a stop."""
        if self.phase == "reporting":
            self._settle()
        elif self.phase == "stopping":
            self._stop()
        elif not self.interlock():
            self._wait_for_leave()
        elif self.phase == "driving":
            self._drive_on()
        else:
            self._obey()

    def external(self, elapsed: int) -> None:
        """Take the order; it is written next, unless the chip is not up or not stopped."""
        try:
            self.take_order()
        except NotReady as error:
            self._refusal = error
        self._has_order = True
        self._is_repeated = False
        if self.phase in {"still", "driving"}:
            self.activate("obeying")
        else:
            self.continue_(elapsed)

    def exit(self) -> None:
        """Leave the motors stopped."""
        self.write_stop()

    def note(self, error: FirmwareRuntimeError) -> None:
        """Keep a fault for the next output; one that follows a bring-up is still in a row."""
        super().note(error)
        self._has_taken_order = False
        self._faults_in_a_row += 1
        self.faults[-1] = self.faults[-1]._replace(consecutive=self._faults_in_a_row)

    # ---------------------------------------------------------------------------------------------

    def _wait_for_leave(self) -> None:
        """Keep the order; switch off unless that was done."""
        self._has_order = self._is_forbidden = True
        if self.phase == "forbidden":
            self.hold_in("forbidden", POLL_PERIOD)
        else:
            self._stop()

    def _obey(self) -> None:
        self._has_order = self._is_forbidden = False
        if not self._is_repeated:
            self._since_order = 0
        self._is_repeated = False
        if self._refusal is None:
            self._write_order()
        else:
            self._refuse(self._refusal)

    def _drive_on(self) -> None:
        self._since_order += self.sigma
        if self._since_order >= self.order_timeout:
            seconds = self.order_timeout / SECOND
            self._refuse(NotReady(f"{self.path}: no order for {seconds:g} s; stopped"))
        else:
            self._write_order()

    def _write_order(self) -> None:
        try:
            self.write_order()
        except HalError as error:
            self._fail(error)
        else:
            self.consecutive_faults = 0
            if self._has_taken_order:
                self._is_doubtful = False
                self._faults_in_a_row = 0
            self._has_taken_order = True
            self.activate("reporting")

    def _fail(self, error: HalError) -> None:
        """Stop, bring the chip up, then write the same again."""
        self.note(error)
        self._is_bring_up_due = True
        self._stop()
        self._has_order = self._is_repeated = self._is_doubtful = True

    def _refuse(self, error: HalError) -> None:
        self.note(error)
        self._refusal = None
        self.forget_order()
        self._stop()

    def _stop(self) -> None:
        try:
            self.write_stop()
        except HalError as error:
            self.note(error)
            self._is_stop_due = self._is_bring_up_due = True
        else:
            self._is_stop_due = False
        self.activate("reporting")

    def _settle(self) -> None:
        """Enter the phase that what was ordered, and what went wrong, lead to."""
        if self._is_stop_due:
            self.hold_in("stopping", STOP_AGAIN_AFTER)
        elif self._is_bring_up_due:
            self.bring_up_again()
        elif self._is_forbidden:
            self.hold_in("forbidden", POLL_PERIOD)
        elif self._has_order:
            self.activate("obeying")
        elif self.is_moving():
            self.hold_in("driving", self._until_next_write())
        else:
            self.passivate("still")

    def _until_next_write(self) -> int:
        if self.order_timeout == NEVER:
            return self.refresh
        return min(self.refresh, self.order_timeout - self._since_order)
