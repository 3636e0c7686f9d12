"""Devantech MD25, two 12 V motors with encoders, on I2C (Devantech, MD25 I2C documentation).

The driver reads encoders, battery, currents and settings and, in the same call, sets both speeds
in one burst. Nothing else talks to the chip after bring-up, and that is the point: its 2 s timeout
stops the motors after 2 s without any transaction, so a program that only reads would keep the
motors of a dead controller turning.

Mode 0 is used, where 128 stands for stop, because it is the power-up mode: after a loss of supply
the next byte still means what it meant. In the signed modes stop is 0, which a chip fallen back to
mode 0 takes for full reverse, and the stop of mode 0 is full reverse there. Another program may
have changed the mode since it was set: every stop asks for it first, and writes it back, since one
wrong bit of the answer would make a stop full reverse; speeds are set only once the settings were
read and are as they should be.

Speed regulation and the timeout are switched on at every bring-up; no register shows whether they
are. The acceleration ramp is the chip's own. Not used: turn modes, change of address.
"""

import struct
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.step import Step
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import HalError

ADDRESSES: Final = range(0x58, 0x60)
SHIPPED_AT: Final = 0x58

SPEED1: Final = 0x00
ENCODER1: Final = 0x02
REVISION: Final = 0x0D
ACCELERATION: Final = 0x0E
MODE: Final = 0x0F
COMMAND: Final = 0x10

UNSIGNED: Final = 0
SIGNED: Final = 0x01
"""Set in the modes, 1 and 3, where speeds are signed."""
LAST_MODE: Final = 3
REGULATOR_ON: Final = 0x31
TIMEOUT_ON: Final = 0x33

STOP: Final = 128
FULL: Final = 127
"""Speed steps from stop to full; the one step more in reverse is left out."""
TIMEOUT_NS: Final = 2_000_000_000
STEP_NS: Final = 25_000_000
"""Ns from one step of the ramp to the next."""

SETTINGS: Final = struct.Struct("3B")
"""Software revision, acceleration, mode: registers 13 to 15."""
REPORT: Final = struct.Struct(">2i3Bx2B")
"""Encoders 1 and 2, battery, currents 1 and 2, then acceleration and mode: registers 2 to 15."""
TRAFFIC: Final[tuple[tuple[Message, ...], ...]] = (
    (bytes((ENCODER1,)), REPORT.size),
    (bytes((SPEED1, STOP, STOP)),),
)
"""Transactions of one setting of the speeds, for the bus-time budget."""
VOLTS_PER_COUNT: Final = 0.1
AMPERES_PER_COUNT: Final = 0.1


class Md25Report(NamedTuple):
    """Registers read right before the speeds were set; motor 1 drives the left side."""

    left_encoder: int
    """Counts since power-up, growing forward; an EMG30 makes 360 a turn."""
    right_encoder: int
    battery_v: float
    left_current_a: float
    right_current_a: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Md25Settings:
    """The ramp, in speed steps of 128 for full speed, one acceleration every 25 ms."""

    acceleration: int = 5
    """That of power-up, too: any other lets a chip that lost its supply be found by it."""

    def faults(self) -> tuple[str, ...]:
        """List every setting the chip cannot have, a sentence each."""
        if 1 <= self.acceleration <= 10:
            return ()
        return (f"acceleration: {self.acceleration}, expected 1 to 10",)


class Md25(I2cChip):
    """One MD25. `timeout_ns` is how long it goes on by itself: speeds are sent more often."""

    chip = "MD25"
    addresses = ADDRESSES
    timeout_ns = TIMEOUT_NS

    def __init__(
        self, bus: I2cBus, address: int = SHIPPED_AT, settings: Md25Settings | None = None
    ) -> None:
        settings = settings or Md25Settings()
        super().__init__(bus, address, settings.faults())
        self._acceleration = settings.acceleration
        self._is_up = False

    # Bring-up -----------------------------------------------------------------------------------

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to stopped and ready; none has to wait.

        The steps raise NoAcknowledge, WrongDevice or NotReady.
        """
        return (
            Step("identify", self.identify, 0),
            Step("stop", self.stop, 0),
            Step("set mode", self._set_mode, 0),
            Step("set acceleration", partial(self._write, ACCELERATION, self._acceleration), 0),
            Step("regulator on", partial(self._write, COMMAND, REGULATOR_ON), 0),
            Step("timeout on", partial(self._write, COMMAND, TIMEOUT_ON), 0),
            Step("verify", self.verify, 0),
        )

    def identify(self) -> None:
        """Check that this can be an MD25; it has no identity register.

        Raises NoAcknowledge if nothing answers, WrongDevice if revision, acceleration and mode
        cannot be an MD25's.
        """
        self._is_up = False
        with self._must_answer("a software revision"):
            found = self._read(REVISION, SETTINGS.size)
        revision, acceleration, mode = SETTINGS.unpack(found)
        if revision in (0x00, 0xFF) or acceleration == 0 or mode > LAST_MODE:
            raise self._wrong_device(
                f"registers 13 to 15 read {found.hex(' ')}, expected a revision, an "
                "acceleration of 01 or more and a mode of 03 at most; another device "
                "answers here"
            )

    def verify(self) -> None:
        """Check that mode and acceleration are as set. Raises NotReady if they are not."""
        _, acceleration, mode = SETTINGS.unpack(self._read(REVISION, SETTINGS.size))
        self._compare(acceleration, mode)

    # Speeds -------------------------------------------------------------------------------------

    def set_speeds(self, left: float, right: float) -> Md25Report:
        """Read the chip and set both speeds, -1 to 1; motors ramp up to them by themselves.

        Two transactions, 21 bytes, 0.49 ms at 400 kHz; both feed the timeout.
        Raises ValueError for a speed outside -1 to 1, nothing was sent then; NotReady before
        bring-up, or if acceleration and mode are not as set, then the old speeds stand; and the
        errors of the bus.
        """
        if not (-1.0 <= left <= 1.0 and -1.0 <= right <= 1.0):
            raise ValueError(f"{self.place}: speeds {left}, {right}, expected -1 to 1")
        if not self._is_up:
            raise self._not_ready("speeds before bring-up", "it brought up first")
        report = REPORT.unpack(self._read(ENCODER1, REPORT.size))
        left_encoder, right_encoder, battery, left_current, right_current, *settings = report
        self._compare(*settings)
        self._write(SPEED1, STOP + round(left * FULL), STOP + round(right * FULL))
        return Md25Report(
            left_encoder,
            right_encoder,
            battery * VOLTS_PER_COUNT,
            left_current * AMPERES_PER_COUNT,
            right_current * AMPERES_PER_COUNT,
        )

    def read_speeds(self) -> bytes:
        """Read both speeds as they are set, a byte each; 5 bytes, 120 us at 400 kHz.

        Another program may have changed them, above all stopped the motors.
        """
        return self._read(SPEED1, 2)

    def stop(self) -> None:
        """Set both speeds to stop, in the words of the mode the chip is in; it ramps down.

        The mode that was read is written before: where it was read wrongly, it is that one now.
        11 bytes, 264 us at 400 kHz. If its mode cannot be read, a chip that was brought up gets the
        stop of mode 0, and the error of reading is raised nevertheless. If what is read is no mode,
        as where nothing drives SDA, it gets that stop too, and WrongDevice is raised: the stop of
        a signed mode would be full reverse in the one that it most likely is in.
        """
        try:
            mode = self._read(MODE, 1)[0]
        except HalError:
            if self._is_up:
                self._write(SPEED1, STOP, STOP)
            raise
        if mode > LAST_MODE:
            self._write(SPEED1, STOP, STOP)
            raise self._wrong_device(
                f"mode reads {mode:02x}, expected 00 to 03; whether it has stopped is not known"
            )
        self._write(MODE, mode)
        self._write(SPEED1, *((0, 0) if mode & SIGNED else (STOP, STOP)))

    def still_on(self) -> str | None:
        """Read back which speeds are not stop, in a sentence; None if none is. In any mode.

        It feeds the chip's timeout: to be followed by a stop if something is on.
        """
        signed = self._read(MODE, 1)[0] & SIGNED
        speeds = self._read(SPEED1, 2)
        if all(speed == (0 if signed else STOP) for speed in speeds):
            return None
        return f"{self.place}: speeds read {speeds[0]}, {speeds[1]}, expected stop"

    # ---------------------------------------------------------------------------------------------

    def _set_mode(self) -> None:
        """Change to mode 0, where the stop of a signed mode means full reverse for a moment.

        One ramp step of the smallest acceleration is the most that can come of it.
        """
        self._write(ACCELERATION, 1)
        self._write(MODE, UNSIGNED)
        self._write(SPEED1, STOP, STOP)

    def _compare(self, acceleration: int, mode: int) -> None:
        self._is_up = (acceleration, mode) == (self._acceleration, UNSIGNED)
        if not self._is_up:
            expected = f"{self._acceleration}, {UNSIGNED}"
            raise self._was_changed(f"acceleration, mode read {acceleration}, {mode}", expected)
