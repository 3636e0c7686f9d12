"""Drivers written for CircuitPython in a robot: over its bus, accounted, retried, on doubles.

    with imports():
        from adafruit_ads1x15 import ADS1115, AnalogIn

    light = CircuitPythonSensor(
        "light", lines.bus("i2c1"),
        make=lambda i2c: AnalogIn(ADS1115(i2c), 0),
        read=lambda channel: channel.voltage,
        kind=float, period=100 * MILLISECOND,
    )

No driver of this project sleeps. One that was written for CircuitPython does, and polls: it
blocks, and cannot be cut into phases. It does so on the robot's lines (`driver_calls`): on doubles
its sleeps take the doubles' time and no real one; on a robot they hold the loop, which the accounts
show. What is to be fast is read in a mode that does not wait.

Not responsible for `time.monotonic` within a driver, which stays real; for SPI and pins; for sleeps
in threads of the driver's own, which stay real too.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from errno import EAGAIN, EBADF, EBUSY, EIO, ENODEV, ETIMEDOUT
from functools import lru_cache
from threading import get_ident
from types import ModuleType
from typing import Final, Generic, Never, TypeVar

from firmware_drivers.chips.step import Step
from firmware_drivers.hardware import HardwareModel
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.circuitpython.i2c_base import CircuitPythonI2c
from firmware_runtime.hal.circuitpython.stand_ins import StandIns
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import (
    EREMOTEIO,
    AddressInUse,
    ArbitrationLost,
    BusAbsent,
    BusTimeout,
    HalError,
    NoAcknowledge,
    NotReady,
    PortClosed,
    WrongDevice,
    from_os_error,
)

FAULTS_BEFORE_BRING_UP: Final = 3
"""Failed readings in a row after which the driver is made again: the chip may have lost supply."""
_ERRNO: Final[tuple[tuple[type[HalError], int], ...]] = (
    (NoAcknowledge, EREMOTEIO),
    (ArbitrationLost, EAGAIN),
    (BusTimeout, ETIMEDOUT),
    (AddressInUse, EBUSY),
    (BusAbsent, ENODEV),
    (PortClosed, EBADF),
)

Driver = TypeVar("Driver")
Value = TypeVar("Value")


def imports() -> StandIns:
    """Return a context within which drivers are imported without Blinka."""
    return StandIns()


class Busio(CircuitPythonI2c):
    """`busio.I2C` over a bus of a robot; what goes wrong is an OSError with its errno."""

    def __init__(self, bus: I2cBus) -> None:
        super().__init__()
        self.bus = bus

    def _transaction(self, address: int, messages: tuple[Message, ...]) -> bytes:
        try:
            return self.bus.transaction(address, messages)
        except HalError as error:
            raise OSError(_errno(error), str(error)) from error


@contextmanager
def driver_calls(bus: I2cBus) -> Iterator[None]:
    """Within it a driver sleeps on the lines of `bus`, and what it raises is a HalError.

    An OSError of its becomes the error that it stands for, however the driver has wrapped it; a
    RuntimeError or ValueError that no bus error led to is WrongDevice, for so these drivers say
    that a chip is another one. Any other exception is a bug and passes.
    """
    with _sleeps_on(bus):
        try:
            yield
        except (OSError, RuntimeError, ValueError) as error:
            raise _hal_error(error, bus.name) from error


class CircuitPythonSensor(HardwareModel, Generic[Driver, Value]):
    """Makes a driver, then reads it every `period` ns and sends on `value` what it read.

    bring_up, made --> sampling;  it failed --fault!--> bring_up (RETRY_AFTER)
    sampling (period) --> reporting (0) --value! or fault!--> sampling, or bring_up after some

    `make` is given `busio.I2C` and returns the driver, `read` is given the driver. A `read` that
    returns None has no value yet: NotReady, as a fault. `port` is another name for `value`.
    """

    def __init__(  # noqa: PLR0913 -- what there is to say of a driver, each by its name
        self,
        name: str,
        bus: I2cBus,
        *,
        make: Callable[[Busio], Driver],
        read: Callable[[Driver], Value | None],
        kind: type[Value],
        period: int,
        port: str = "value",
    ) -> None:
        super().__init__(name, self._steps, bus)
        if period <= 0:
            raise SettingError(f"period of {period} ns", where=name, expected="more than 0 ns")
        self.value = self.out_port(port, kind)
        self.driver: Driver | None = None
        self._bus = bus
        self._make = make
        self._read = read
        self._period = period
        self._sample: Value | None = None

    def begin(self) -> None:
        """Read a period after the bring-up."""
        self.hold_in("sampling", self._period)

    def output(self) -> None:
        """Send the value read, or what went wrong."""
        super().output()
        if self._sample is not None:
            self.value.send(self._sample)

    def proceed(self) -> None:
        """Read, or rest until the next period."""
        if self.phase == "sampling":
            self._take()
        elif self.consecutive_faults and self.consecutive_faults % FAULTS_BEFORE_BRING_UP == 0:
            self.bring_up_again()
        else:
            self._sample = None
            self.begin()

    def state(self) -> Never:
        """Raise TypeError: what such a driver holds is its own."""
        raise TypeError("what a driver of CircuitPython holds is its own")

    def restore(self, state: object) -> None:
        """There is nothing to restore; a replay begins at the start of the run."""

    def _steps(self) -> tuple[Step, ...]:
        return (Step("driver made", self._bring_up_driver, 0),)

    def _bring_up_driver(self) -> None:
        self._sample = None
        with driver_calls(self._bus):
            self.driver = self._make(Busio(self._bus))

    def _take(self) -> None:
        self._sample = None
        try:
            self._sample = self._reading()
        except HalError as error:
            self.note(error)
        else:
            self.consecutive_faults = 0
        self.activate("reporting")

    def _reading(self) -> Value:
        assert self.driver is not None  # noqa: S101 -- it is made before anything is read
        with driver_calls(self._bus):
            value = self._read(self.driver)
        if value is None:
            raise NotReady(f"{self.name} on {self._bus.name}: the driver has no value yet")
        return value


@contextmanager
def _sleeps_on(bus: I2cBus) -> Iterator[None]:
    """Let `sleep` be the bus's pause in `time`, and in Adafruit's modules that have it by name."""
    real, caller = time.sleep, get_ident()

    def pause(seconds: float) -> None:
        if get_ident() == caller:
            bus.pause(round(seconds * SECOND))
        else:  # another thread of the program, which has its own reasons
            real(seconds)

    holders = [time, *_with_own_sleep(len(sys.modules))]
    for holder in holders:
        holder.sleep = pause  # type: ignore[attr-defined]
    try:
        yield
    finally:
        for holder in holders:
            holder.sleep = real  # type: ignore[attr-defined]


@lru_cache(maxsize=1)
def _with_own_sleep(_loaded: int) -> tuple[ModuleType, ...]:
    """Adafruit's modules that have `sleep` by name; looked for again when a module was loaded."""
    return tuple(
        module
        for name, module in list(sys.modules.items())
        if name.startswith("adafruit_") and vars(module).get("sleep") is time.sleep
    )


def _errno(error: HalError) -> int:
    for kind, number in _ERRNO:
        if isinstance(error, kind):
            return number
    return EIO


def _hal_error(error: BaseException, where: str) -> HalError:
    """The HalError that led to what a driver raised, or the one that it amounts to."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, HalError):
            return cause
        if isinstance(cause, OSError) and cause.__cause__ is None:
            return from_os_error(cause, where)
        cause = cause.__cause__ or cause.__context__
    return WrongDevice(error, where=where, expected="the chip that the driver is for")
