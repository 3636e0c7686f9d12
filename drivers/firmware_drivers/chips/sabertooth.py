"""Dimension Engineering Sabertooth dual motor drivers, packet serial (user guides 2x5, 2x12).

The driver sets both speeds by packets of four bytes: address, command, value, checksum. The line
has one direction only, so nothing is ever known about the other end: an absent, browned-out or deaf
Sabertooth looks like a good one. Its serial timeout is what stops the motors when packets stop
coming; it is off at power-up and forgotten with the supply, so it is sent with every speed.

Models that find the rate out by themselves (2x5, 2x10, 2x25) want one byte of AA after power-up
and before anything else; sent to them before they are up, or not sent after a brown-out, they stay
deaf, and still. Models that store their rate ignore it. Ramping, deadband, battery limits and
stored rate are left as they are; mixed mode is not used.
"""

from dataclasses import dataclass
from functools import partial
from typing import Final

from firmware_drivers.chips.step import Step
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.serial import SerialPort

ADDRESSES: Final = range(128, 136)
SHIPPED_AT: Final = 128

AUTOBAUD: Final = b"\xaa"
M1_FORWARD: Final = 0
M2_FORWARD: Final = 4
BACKWARD: Final = 1
"""Added to a forward command."""
SERIAL_TIMEOUT: Final = 14

FULL: Final = 127
SEVEN_BITS: Final = 0x7F
TIMEOUT_STEP_NS: Final = 100_000_000
AUTOBAUD_NS: Final = 500_000_000
"""The maker's Arduino library waits as long between the byte and the first packet."""


def packet(address: int, command: int, value: int) -> bytes:
    """Build one packet; the checksum is the low seven bits of the sum of the other bytes."""
    if address not in ADDRESSES or not (0 <= command <= SEVEN_BITS and 0 <= value <= SEVEN_BITS):
        raise ValueError(
            f"Sabertooth packet: address {address}, command {command}, value {value}; "
            "expected 128 to 135 and twice 0 to 127"
        )
    return bytes((address, command, value, (address + command + value) & SEVEN_BITS))


def speed_packet(address: int, forward_command: int, speed: float) -> bytes:
    """Build the packet that sets one motor to a speed from -1 to 1, in 127ths."""
    steps = round(speed * FULL)
    return packet(address, forward_command + (BACKWARD if steps < 0 else 0), abs(steps))


@dataclass(frozen=True, slots=True, kw_only=True)
class SabertoothSettings:
    """The timeout, and whether this model finds its rate out by itself."""

    timeout_ns: int = 3 * TIMEOUT_STEP_NS
    """Silence after which the motors stop, in whole tenths of a second."""
    autobaud: bool = True

    def faults(self) -> tuple[str, ...]:
        """List every setting the chip cannot have, a sentence each."""
        steps, rest = divmod(self.timeout_ns, TIMEOUT_STEP_NS)
        if 1 <= steps <= SEVEN_BITS and rest == 0:
            return ()
        return (f"timeout_ns: {self.timeout_ns}, expected 0.1 s to 12.7 s in steps of 0.1 s",)


class Sabertooth:
    """One Sabertooth: motor 1 drives the left side, motor 2 the right.

    `timeout_ns` is how long it goes on by itself: speeds are sent more often.
    """

    def __init__(
        self,
        port: SerialPort,
        address: int = SHIPPED_AT,
        settings: SabertoothSettings | None = None,
    ) -> None:
        settings = settings or SabertoothSettings()
        self.address = address
        self.place = f"Sabertooth {address} on {port.name}"
        faults = settings.faults()
        if address not in ADDRESSES:
            faults = (f"address: {address}, expected 128 to 135", *faults)
        if faults:
            raise SettingError("; ".join(faults), where=self.place)
        self.timeout_ns = settings.timeout_ns
        self.line = self._port = port
        self._autobaud = settings.autobaud
        steps = settings.timeout_ns // TIMEOUT_STEP_NS
        self._timeout_packet = packet(address, SERIAL_TIMEOUT, steps)

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps to stopped and ready, 0.5 s where the rate has to be found out.

        The steps raise BusTimeout, BusFault or PortClosed; an absent driver goes unnoticed.
        """
        autobaud = Step("send autobaud byte", partial(self._port.write, AUTOBAUD), AUTOBAUD_NS)
        return (*((autobaud,) if self._autobaud else ()), Step("stop", self.stop, 0))

    def set_speeds(self, left: float, right: float) -> None:
        """Set both speeds, -1 to 1, and the timeout again; 12 bytes, 12.5 ms on a 9600 baud line.

        Returns when the port has taken the bytes; that they arrived is not known.
        Raises ValueError for a speed outside -1 to 1, nothing was sent then; BusTimeout, BusFault
        or PortClosed.
        """
        if not (-1.0 <= left <= 1.0 and -1.0 <= right <= 1.0):
            raise ValueError(f"{self.place}: speeds {left}, {right}, expected -1 to 1")
        self._port.write(
            self._timeout_packet
            + speed_packet(self.address, M1_FORWARD, left)
            + speed_packet(self.address, M2_FORWARD, right)
        )

    def stop(self) -> None:
        """Set both speeds to zero, and the timeout again, should the stop itself get lost."""
        self.set_speeds(0.0, 0.0)
