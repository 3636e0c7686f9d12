"""Clock of an I2C wire as it is, timed by reads of two lengths from one register of a chip.

What adapter, kernel and Python take for a transaction is in both and drops out of their difference,
which is bits alone: 16 bytes of nine. Disturbances only lengthen, so the shortest of many is taken,
twice; two answers that differ are none. Nothing is written but the number of the register.
"""

from collections.abc import Callable, Sequence
from typing import Final

from msgspec import Struct

from firmware_runtime.devs.time import MICROSECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits, wire_ns
from firmware_runtime.hal.i2c import I2cBus, Message

SHORT, LONG = 1, 17
"""Bytes that are read; the long one fits into the adapters' buffers but for one byte."""
REPETITIONS: Final = 40
AGREEMENT: Final = 0.03
FASTEST_HZ: Final = 3_400_000
"""High-speed mode of the bus; what answers sooner has no wire."""


class MeasuredWire(Struct, frozen=True):
    """Clock of a wire as measured, and what a transaction takes beside its bits."""

    speed_hz: int
    overhead_us: float


def measured_clock(
    bus: I2cBus, address: int, register: Sequence[Message], now: Callable[[], int]
) -> MeasuredWire:
    """Time a wire by reads that begin with these messages; `now` gives ns.

    Raises HalError as the bus does, SettingError where the times say nothing of a clock.
    """
    halves = [_shortest(bus, address, register, now) for _ in range(2)]
    first, second = (_slope(long - short) for short, long in halves)
    if abs(first - second) > AGREEMENT * first:
        raise SettingError(f"two measurements gave {first} and {second} Hz", where=bus.name)
    short = min(short for short, _ in halves)
    speed_hz = _slope(min(long for _, long in halves) - short)
    if speed_hz > FASTEST_HZ:
        raise SettingError(f"{speed_hz} Hz is faster than a wire can be", where=bus.name)
    beside = short - wire_ns(bits((*register, SHORT)), speed_hz)
    return MeasuredWire(speed_hz, max(beside, 0) / MICROSECOND)


def _shortest(
    bus: I2cBus, address: int, register: Sequence[Message], now: Callable[[], int]
) -> tuple[int, int]:
    """The shortest time of a short and of a long read, ns, taking turns."""
    times: dict[int, list[int]] = {SHORT: [], LONG: []}
    for _ in range(REPETITIONS):
        for length, taken in times.items():
            messages = (*register, length)
            begun = now()
            bus.transaction(address, messages)
            taken.append(now() - begun)
    return min(times[SHORT]), min(times[LONG])


def _slope(ns: int) -> int:
    """Return the clock, Hz, at which the longer read takes so much longer."""
    return 9 * (LONG - SHORT) * SECOND // max(ns, 1)
