"""One row of the chip contract: how to wire a driver and its double, use them and sweep them."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import ClassVar, Protocol, TypeAlias

from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.i2c import Message
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target

Vector: TypeAlias = tuple[float, float, float]
MILLISECOND = 1_000_000


class Step(Protocol):
    """One step of a driver's bring-up, as `firmware_drivers.chips.step` has it."""

    @property
    def action(self) -> Callable[[], None]:
        """At most a few short transactions."""

    @property
    def wait_ns(self) -> int:
        """The wait that the chip needs after."""


class Row(ABC):
    """A chip's driver and double on one bus, with a clock on which only the wire takes time."""

    name: ClassVar[str]
    """The chip, as its driver's module is called."""
    address: ClassVar[int]
    wrong_identity: ClassVar[tuple[int, int] | None]
    """A register and what it reads on another chip; None if the chip has no identity."""
    traffic: ClassVar[Sequence[Sequence[Message]]] = ()
    """Messages of one use by the driver's own account, if it gives one."""
    keeps_nothing: ClassVar[bool] = False
    """True if a loss of power costs the chip nothing that the driver had set."""

    reported_as: ClassVar[str] = "expected"
    """A word of the sentence that reports a loss of power."""

    def __init__(self, adapter: str = "bcm2835", *, absent: bool = False) -> None:
        self.clock = ManualClock()
        self.targets = [] if absent else self.build()
        self.faults = FaultScript()
        self.wire = I2cBusDouble(
            "i2c-1",
            self.clock,
            self.targets,
            adapter=adapter,
            reach=self.clock.reach,
            faults=self.faults,
        )
        self.bus = AccountedBus(self.wire, 400_000)

    @abstractmethod
    def build(self) -> Sequence[Target]:
        """Make the double, and what it needs beside it."""

    @abstractmethod
    def steps(self) -> Sequence[Step]:
        """Give the driver's bring-up."""

    @abstractmethod
    def use(self) -> None:
        """Do what the chip is for, once."""

    @abstractmethod
    def verify(self) -> None:
        """Have the driver check that the chip is as brought up."""

    def look_after_power_loss(self) -> None:
        """Do what detects that the chip lost its settings."""
        self.verify()

    @abstractmethod
    def sweep(self) -> Iterator[tuple[float, float, float]]:
        """Give true value, value through driver and double, and how far apart they may be."""

    @abstractmethod
    def warnings(self) -> list[str]:
        """List what the double objects to."""

    def bring_up(self) -> None:
        """Take the steps, each with its wait."""
        for step in self.steps():
            step.action()
            self.clock.advance(step.wait_ns)


def each(true: Vector, found: Vector, step: float) -> Iterator[tuple[float, float, float]]:
    """Compare by axis; rounding on both sides leaves one step at most."""
    for one, other in zip(true, found, strict=True):
        yield one, other, step
