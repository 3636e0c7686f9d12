"""Double of a Sabertooth 2x5, 2x10, 2x12 or 2x25, two motors on a serial line in packet mode.

Source: Dimension Engineering's user guides, packetized serial. The line goes to the driver only.

Modelled: the autobaud byte, packets with address and checksum, all driving commands, mixed mode
that waits for drive and turn, ramping, deadband, the serial timeout, and what a power cycle takes:
autobaud and timeout, while ramping and deadband are kept.

Not modelled: the baud rate itself (command 15), the battery limits (commands 2 and 3), the two
seconds after power-up, power save, load. Assumed where the guides are silent: motor 1 is the left
one in mixed mode, and a sum beyond full speed is cut; any packet taken feeds the timeout, which
stops the motors at once and forgets their commands; a ramp goes in the 256 steps of its time,
ramping 0 jumps, above 80 is ignored.
"""

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from sim_doubles.chips.devantech import checked_address
from sim_doubles.chips.motor_pair import MotorDriverDouble, MotorPair
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.clock import Now
from sim_doubles.serial_line import SerialTarget

ADDRESSES = range(128, 136)

AUTOBAUD = 0xAA
PACKET_LENGTH = 4
CHECKSUM_MASK = 0x7F

TIMEOUT = 14
BAUD = 15
RAMPING = 16
DEADBAND = 17
BATTERY_LIMITS = (2, 3)

FULL = 127
STILL = 64  # of the 7-bit commands
INDEPENDENT, MIXED = 0, 1
# command: command set, index in it, sign; 0 for a 7-bit command
DRIVING = {
    0: (INDEPENDENT, 0, 1),
    1: (INDEPENDENT, 0, -1),
    4: (INDEPENDENT, 1, 1),
    5: (INDEPENDENT, 1, -1),
    6: (INDEPENDENT, 0, 0),
    7: (INDEPENDENT, 1, 0),
    8: (MIXED, 0, 1),
    9: (MIXED, 0, -1),
    10: (MIXED, 1, 1),
    11: (MIXED, 1, -1),
    12: (MIXED, 0, 0),
    13: (MIXED, 1, 0),
}

TIMEOUT_UNIT = 100 * MILLISECOND
DEFAULT_RAMPING = 1
MOST_RAMPING = 80
DEFAULT_DEADBAND = 3


class SabertoothDouble(MotorDriverDouble, SerialTarget):
    """A Sabertooth with its address switches at `address`, 128 to 135.

    `autobaud` False is a model that stores its baud rate. World face: `motors` (speeds, turns, what
    will come) and `speeds`, the share of full speed from -1 to 1.
    """

    def __init__(
        self,
        now: Now,
        address: int = ADDRESSES[0],
        *,
        full_speed_rad_s: float = 17.8,
        autobaud: bool = True,
    ) -> None:
        self.address = checked_address("Sabertooth", address, ADDRESSES)
        self.warnings = ProtocolWarnings(f"Sabertooth {address}")
        self.motors = MotorPair(now(), FULL, full_speed_rad_s)
        self._now = now
        self._autobaud = autobaud
        self._step_period = _step_period(DEFAULT_RAMPING)
        self._deadband = DEFAULT_DEADBAND
        self._reset()

    # World face

    @property
    def speeds(self) -> tuple[float, float]:
        """Return the speeds of motors 1 and 2 now, as a share of full speed."""
        first, second = self.motors.units(self._now())
        return first / FULL, second / FULL

    def power_cycle(self) -> None:
        """Lose supply and get it back: stopped, no timeout, waiting for the autobaud byte."""
        self._reset()

    # Line face

    def receive(self, data: bytes) -> None:
        """Take bytes; whatever makes up no packet for this address is ignored with a warning."""
        for byte in data:
            if not self._bauded:
                self._take_first(byte)
            elif byte & 0x80:
                self._begin_packet(byte)
            elif self._packet:
                self._packet.append(byte)
                if len(self._packet) == PACKET_LENGTH:
                    self._take_packet(*self._packet)
                    self._packet.clear()
            else:
                self.warnings.note(f"byte 0x{byte:02x} outside a packet; it is ignored")

    def transmitted(self, at: int) -> bytes:  # noqa: ARG002 (at no instant)
        """Return nothing: the driver has no transmitter."""
        return b""

    # Packets

    def _reset(self) -> None:
        self._bauded = not self._autobaud
        self._packet = bytearray()
        self._timeout = 0
        self.motors.halt(self._now())
        self._forget_commands(INDEPENDENT)

    def _take_first(self, byte: int) -> None:
        if byte == AUTOBAUD:
            self._bauded = True
        else:
            self.warnings.note(f"byte 0x{byte:02x} before the autobaud byte 0xaa; it is ignored")

    def _begin_packet(self, byte: int) -> None:
        if self._packet:
            self.warnings.note(f"packet {self._packet.hex(' ')} cut short; it is ignored")
        self._packet.clear()
        if byte != AUTOBAUD:
            self._packet.append(byte)

    def _take_packet(self, address: int, command: int, value: int, checksum: int) -> None:
        if address != self.address:
            self.warnings.note(f"packet for address {address}; it is ignored")
        elif checksum != (address + command + value) & CHECKSUM_MASK:
            self.warnings.note(
                f"packet {self._packet.hex(' ')} has a wrong checksum; it is ignored"
            )
        else:
            self._restart_timeout()
            self._obey(command, value)

    def _restart_timeout(self) -> None:
        """Restart the timeout: a valid packet came."""
        now = self._now()
        stops_at = now + self._timeout * TIMEOUT_UNIT if self._timeout else NEVER
        if self.motors.put_off_stop(now, stops_at):
            self._forget_commands(self._command_set)

    # Commands

    def _obey(self, command: int, value: int) -> None:
        if command in DRIVING:
            self._take_driving(*DRIVING[command], value)
        elif command == TIMEOUT:
            self._timeout = value
            self._restart_timeout()
        elif command == RAMPING and value <= MOST_RAMPING:
            self._step_period = _step_period(value)
            self._drive()
        elif command == DEADBAND:
            self._deadband = value or DEFAULT_DEADBAND
            self._drive()
        elif command not in {*BATTERY_LIMITS, BAUD}:
            self.warnings.note(f"command {command} with {value} does not exist; it is ignored")

    def _take_driving(self, command_set: int, index: int, sign: int, value: int) -> None:
        if command_set != self._command_set:
            self._forget_commands(command_set)
        self._commands[index] = sign * value if sign else _from_7_bit(value)
        self._drive()

    def _forget_commands(self, command_set: int) -> None:
        self._command_set = command_set
        self._commands: list[int | None] = [None, None]

    # Motors

    def _drive(self) -> None:
        first, second = (self._beyond_deadband(speed) for speed in self._wanted())
        self.motors.drive(self._now(), (first, second), 1, self._step_period)

    def _wanted(self) -> tuple[int, int]:
        """Return the commanded speeds; a motor without a command stands still."""
        first, second = self._commands
        if self._command_set == INDEPENDENT:
            return first or 0, second or 0
        if first is None or second is None:
            return 0, 0
        return _limited(first + second), _limited(first - second)

    def _beyond_deadband(self, speed: int) -> int:
        return 0 if abs(speed) < self._deadband else speed


def _step_period(ramping: int) -> int:
    """Return the ns for each of the 256 steps from full reverse to full forward; 0 jumps.

    The time is 256 / (1000 x ramping) s up to 10, then 256 / (15.25 x (ramping - 10)) s.
    """
    if ramping == 0:
        return 0
    if ramping <= 10:
        return MILLISECOND // ramping
    return 4 * SECOND // (61 * (ramping - 10))


def _from_7_bit(value: int) -> int:
    """Return the speed a 7-bit command stands for: 0 full reverse, 64 stop, 127 full forward."""
    offset = value - STILL
    return round(offset * FULL / (FULL - STILL if offset > 0 else STILL))


def _limited(speed: int) -> int:
    return max(-FULL, min(FULL, speed))
