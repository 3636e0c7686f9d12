"""Base of hardware models over one chip: its bring-up, tried again and again, and its faults.

A chip that needs time needs it from the end of a transaction, and a transaction takes time on the
wire. So a phase that waits for a chip is entered by `hold_after_transfer`, not by `hold_in`.

Bring-up goes one step an activation, so that no call sleeps.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Iterator
from typing import Any, Protocol, runtime_checkable

from firmware_drivers.chips.shared_bring_up import SharedBringUp
from firmware_drivers.chips.step import Step
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.hal.budget import Line
from firmware_runtime.hal.wire_errors import Fault, HalError

RETRY_AFTER = 100_000_000
"""Ns to wait before a bring-up that failed is begun again."""


class BringUp:
    """The steps of one chip; `take` carries out the next and says how long to wait after it.

    It can be kept and set back in the middle, unless a generator gives the steps.
    """

    def __init__(self, steps: Callable[[], Iterable[Step]]) -> None:
        self._begin = steps
        self._steps: Iterator[Step] = iter(())
        self._taken: int | None = None
        """Steps taken since it was begun; None while none are under way."""
        self.step = ""

    def restart(self) -> None:
        """Begin again with the first step; steps that were under way are given up."""
        if isinstance(self._steps, SharedBringUp):
            self._steps.restart()  # the same one, since its state is kept by itself too
        else:
            if isinstance(self._steps, Generator):
                self._steps.close()
            self._steps = iter(self._begin())
        self._taken = 0

    def take(self) -> int | None:
        """Carry out the next step; return ns to wait after it, or None when all are done.

        Raises HalError if the step failed; the next call then begins again.
        """
        step = next(self._steps, None)
        if step is None:
            self._taken = None
            return None
        self._taken = (self._taken or 0) + 1
        self.step = step.name
        try:
            step.action()
        except BaseException:
            self.restart()
            raise
        return step.wait_ns

    def state(self) -> dict[str, Any]:
        """Return the number of steps taken. Raises TypeError for a generator under way."""
        steps, taken = self._steps, self._taken
        shared = steps.state() if isinstance(steps, SharedBringUp) else None
        if isinstance(steps, Generator) and taken is not None:
            raise TypeError("a generator gives its steps; expected a tuple of them")
        return {"step": self.step, "taken": taken, "shared": shared}

    def restore(self, state: dict[str, Any]) -> None:
        """Be there again; no step is carried out."""
        self.step, self._taken, shared = state["step"], state["taken"], state["shared"]
        if shared is None or not isinstance(self._steps, SharedBringUp):
            is_begun = self._taken is not None or shared is not None
            self._steps = iter(self._begin() if is_begun else ())
        if isinstance(self._steps, SharedBringUp):
            self._steps.restore(shared)
        else:
            for _ in range(self._taken or 0):
                next(self._steps, None)


def failed_in_a_row(times: int) -> str:
    """Say in words how a device failed whose last transactions did."""
    return "has failed" if times == 1 else f"has failed {times} times in a row"


class Chip(Protocol):
    """A chip's driver, as the model over it has it."""

    @property
    def place(self) -> str:
        """Return the chip's name and address, for the sentence of an error."""

    @property
    def line(self) -> Line:
        """Return its connection."""

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to ready, whatever it drives stopped."""


@runtime_checkable
class Identifiable(Protocol):
    """A chip that answers at once; one that only listens, or only sends, does not."""

    def identify(self) -> None:
        """Check that it is there and can be what it should be. Raises HalError."""


@runtime_checkable
class ReadBack(Protocol):
    """A chip that drives something and can be read back."""

    def still_on(self) -> str | None:
        """Return a sentence with its outputs that are on; None if none is. Raises HalError."""


class HardwareModel(Atomic, ABC):
    """Brings its chip up, then leaves the phases to the subclass; sends all faults noted.

    `line` is the bus or port that the chip is on, `period` the ns from one reading to the next, 0
    for a model that does not read at a period.

    bring_up (the steps' waits) --> the subclass's own phases
    bring_up, a step failed --> bring_up_failed (0) --fault!--> bring_up (RETRY_AFTER)
    """

    bring_up_proves = True
    """True if a bring-up that worked ends faults in a row; of a sensor its next reading does."""

    def __init__(
        self, name: str, bring_up: Callable[[], Iterable[Step]], line: Line, period: int = 0
    ) -> None:
        super().__init__(name)
        self.fault_out = self.out_port("fault", Fault)
        self.faults: list[Fault] = []
        self._consecutive_faults = 0
        self._failed_uses = 0
        self._has_worked = False
        self._line = line
        self._reading_period = period
        self._bring_up = BringUp(bring_up)

    @property
    def lines(self) -> tuple[Line, ...]:
        """The bus or port that it is on: by this the runtime knows a component with hardware."""
        return (self._line,)

    @property
    def consecutive_faults(self) -> int:
        """Faults since the last good use; a subclass sets it to 0 after each of those."""
        return self._consecutive_faults

    @consecutive_faults.setter
    def consecutive_faults(self, faults: int) -> None:
        self._consecutive_faults = faults
        self._has_worked = True

    @abstractmethod
    def begin(self) -> None:
        """Enter the first phase of one's own: the chip is up."""

    @abstractmethod
    def proceed(self) -> None:
        """Go on from a phase of one's own whose time advance ran out."""

    def unready(self) -> str | None:
        """Return why the device does not work, in a few words; None if it does."""
        if self.phase.startswith("bring_up"):
            return "is not up yet"
        if self._consecutive_faults > 0:
            return failed_in_a_row(self._consecutive_faults)
        return None

    def failed_uses(self) -> int:
        """Return failed uses of its chip once it was up; 0 if a use was ever good."""
        return 0 if self._has_worked else self._failed_uses

    def initialize(self) -> None:
        """Begin the chip's bring-up at once."""
        self.bring_up_again()

    def output(self) -> None:
        """Send the faults noted since the last time."""
        for fault in self.faults:
            self.fault_out.send(fault)

    def internal(self) -> None:
        """Go on with the bring-up, or with what the subclass does."""
        self.faults.clear()
        if self.phase == "bring_up":
            self.continue_bring_up()
        elif self.phase == "bring_up_failed":
            self.wait_in_bring_up(RETRY_AFTER)
        else:
            self.proceed()

    def hold_after_transfer(self, phase: str, duration: int) -> None:
        """Stay in a phase until `duration` ns after the last transfer has ended on the wire."""
        self.hold_in(phase, self._line.elapsed() + duration)

    def wait_in_bring_up(self, duration: int) -> None:
        """Let the chip alone for `duration` ns, then take the next step of the bring-up."""
        self.hold_in("bring_up", duration)

    def bring_up_again(self) -> None:
        """Leave whatever phase it is in for the first step of the bring-up."""
        self._bring_up.restart()
        self.activate("bring_up")

    def note(self, error: FirmwareRuntimeError) -> None:
        """Keep a fault for the next output; the caller then enters a phase of zero time."""
        self._consecutive_faults += 1
        if not self.phase.startswith("bring_up"):
            self._failed_uses += 1
        self.faults.append(Fault.of(error, self._consecutive_faults, self._reading_period))

    def continue_bring_up(self) -> None:
        """Take the next step of the bring-up: the last one's wait is over."""
        try:
            wait = self._bring_up.take()
        except HalError as error:
            self.note(error)
            self.activate("bring_up_failed")
            return
        if wait is None:
            if self.bring_up_proves:
                self._consecutive_faults = 0
            self.begin()
        elif wait == 0:
            self.activate("bring_up")
        else:
            self.wait_in_bring_up(self._line.elapsed() + wait)
