"""Double of the Devantech MD25, two motors with encoders on I2C. Source: Devantech's MD25 page.

Modelled: the four modes, turning with a difference that is kept, acceleration in steps of 25 ms,
encoders with 360 counts a turn, captured by their first byte, battery, currents, version, commands
with the change of address, and the motor timeout: 2 s without any traffic to the chip.

Not modelled: load, so regulation changes nothing; the serial mode; the LED. Assumed where the page
is silent: speed is proportional to the register, 127 being `full_speed_rad_s`; speeds count from
STOP, the first step follows 25 ms later, or with the steps under way; a new mode, like the timeout,
stops the motors at once and puts its stop value into the speed registers; what cannot be (a mode
above 3, an acceleration of 0 or above 10) is ignored; speed 0 turns as forward does; encoders stand
for the whole counts passed.
"""

import math
from struct import Struct

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from sim_doubles.chips.devantech import DevantechDouble
from sim_doubles.chips.motor_pair import MotorDriverDouble, MotorPair
from sim_doubles.clock import Now

ADDRESSES = range(0x58, 0x60)

SPEED1 = 0
SPEED2 = 1
ENCODER1 = 2
ENCODER2 = 6
BATTERY = 10
CURRENT1 = 11
CURRENT2 = 12
VERSION = 13
ACCELERATION = 14
MODE = 15
COMMAND = 16

RESET_ENCODERS = 0x20
REGULATOR_OFF, REGULATOR_ON = 0x30, 0x31
TIMEOUT_OFF, TIMEOUT_ON = 0x32, 0x33

LEAST, LARGEST = -128, 127
STOP_BYTE = (128, 0, 128, 0)  # by mode
ACCELERATIONS = range(1, 11)
STEP = 25 * MILLISECOND
TIMEOUT = 2 * SECOND
COUNTS_PER_TURN = 360
ENCODER = Struct(">I")


class Md25Double(MotorDriverDouble, DevantechDouble):
    """An MD25 with two EMG30 motors, whose rated speed is 170 rpm.

    World face: `motors` (speeds, turns, what will come), `battery_v`, `currents_a`; `regulated`
    is whether speed regulation is on. Before version 2 the timeout cannot be switched.
    """

    def __init__(  # noqa: PLR0913 (what varies between modules, one line each)
        self,
        now: Now,
        address: int = ADDRESSES[0],
        *,
        full_speed_rad_s: float = 17.8,
        battery_v: float = 12.0,
        currents_a: tuple[float, float] = (0.0, 0.0),
        version: int = 2,
    ) -> None:
        super().__init__(now, "MD25", address, ADDRESSES)
        self.motors = MotorPair(self._at, LARGEST, full_speed_rad_s)
        self.battery_v = battery_v
        self.currents_a = currents_a
        self._version = version
        self._timeout_on = True
        self._speed_written = False  # new speeds wait for STOP
        self._reset()

    @property
    def content(self) -> bytes:
        """Return what stands in its 17 registers; the encoders as if both were captured now."""
        self._at = self._now()
        encoders = (self._count(motor) for motor in range(2))
        settings = self._readable()
        return bytes((*self._speeds, *b"".join(map(ENCODER.pack, encoders)))) + bytes(
            settings.get(register, 0) for register in range(BATTERY, COMMAND + 1)
        )

    # Bus face

    def _begin(self) -> None:
        stops_at = self._at + TIMEOUT if self._timeout_on else NEVER
        if self.motors.put_off_stop(self._at, stops_at):
            self._speeds = [STOP_BYTE[self._mode]] * 2

    def _end(self) -> None:
        if self._speed_written:
            self._speed_written = False
            self._drive()

    def _read_register(self, register: int) -> int:
        if register <= SPEED2:
            return self._speeds[register]
        if register < BATTERY:
            return self._read_encoder(register)
        return self._readable().get(register, 0)

    def _write_register(self, register: int, byte: int) -> None:
        if register == COMMAND:
            self._take_command(byte)
            return
        self._break_off()
        if register <= SPEED2:
            self._speeds[register] = byte
            self._speed_written = True
        elif register == ACCELERATION and byte in ACCELERATIONS:
            self._acceleration = byte
            self._speed_written = True
        elif register == MODE and byte < len(STOP_BYTE):
            self._write_mode(byte)
        else:
            self.warnings.note(f"register {register} written {byte}; the write is ignored")

    # Registers

    def _reset(self) -> None:
        """Take the power-up values: stopped, mode 0, encoders 0."""
        super()._reset()
        self._mode = 0
        self._acceleration = 5
        self._speeds = [STOP_BYTE[0]] * 2
        self._captured = bytearray(BATTERY)
        self._speed_written = False
        self.regulated = True
        self._timeout_on = True
        self.motors.halt(self._at)
        self.motors.put_off_stop(self._at, self._at + TIMEOUT)
        self._zeros = self._counts()

    def _readable(self) -> dict[int, int]:
        return {
            BATTERY: _tenths(self.battery_v),
            CURRENT1: _tenths(self.currents_a[0]),
            CURRENT2: _tenths(self.currents_a[1]),
            VERSION: self._version,
            ACCELERATION: self._acceleration,
            MODE: self._mode,
        }

    def _write_mode(self, mode: int) -> None:
        if mode != self._mode:
            self._mode = mode
            self._speeds = [STOP_BYTE[mode]] * 2
            self._speed_written = False
            self.motors.halt(self._at)

    def _obey(self, command: int) -> bool:
        if command == RESET_ENCODERS:
            self._zeros = self._counts()
        elif command in {REGULATOR_OFF, REGULATOR_ON}:
            self.regulated = command == REGULATOR_ON
        elif command in {TIMEOUT_OFF, TIMEOUT_ON} and self._version >= 2:
            self._timeout_on = command == TIMEOUT_ON
            self.motors.put_off_stop(self._at, self._at + TIMEOUT if self._timeout_on else NEVER)
        else:
            return False
        return True

    # Motors

    def _drive(self) -> None:
        offset = STOP_BYTE[self._mode]
        first, second = (_signed(byte - offset) for byte in self._speeds)
        if self._mode >= 2:
            first, second = _turning(first, second)
        self.motors.drive(self._at, (first, second), self._acceleration, STEP)

    def _counts(self) -> tuple[int, ...]:
        turned = self.motors.turned_rad(self._at)
        return tuple(math.floor(angle / math.tau * COUNTS_PER_TURN) for angle in turned)

    def _read_encoder(self, register: int) -> int:
        """Give a byte of an encoder; its first one captures the count."""
        if register in {ENCODER1, ENCODER2}:
            motor = 0 if register == ENCODER1 else 1
            ENCODER.pack_into(self._captured, register, self._count(motor))
        return self._captured[register]

    def _count(self, motor: int) -> int:
        return self._counts()[motor] - self._zeros[motor] & 0xFFFFFFFF


def _signed(value: int) -> int:
    """Return what a byte stands for as two's complement; smaller numbers stand for themselves."""
    return value - 256 if value > LARGEST else value


def _turning(speed: int, turn: int) -> tuple[int, int]:
    """Return both speeds of modes 2 and 3; one that is out of reach takes the other along."""
    if speed < 0:
        turn = -turn
    first, second = speed - turn, speed + turn
    excess = max(first, second, LARGEST) - LARGEST
    shortage = min(first, second, LEAST) - LEAST
    shift = excess + shortage
    return _limited(first - shift), _limited(second - shift)


def _limited(speed: int) -> int:
    return max(LEAST, min(LARGEST, speed))


def _tenths(value: float) -> int:
    """Return a register in tenths of a unit, 0 to 255."""
    return max(0, min(255, round(value * 10)))
