"""Chips whose readings die in eight ways, and after how many readings their drivers say so.

Each chip is a double with its noise, and its driver; between both a bus alters the words that are
read, as a broken part would. The table in docs/safety.md is what this finds:

    FIRMWARE_RUNTIME_DEAD_SENSORS=1 .venv/bin/python -m pytest tests/safety/test_dead_sensors.py
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Literal, NamedTuple, TypeAlias

from firmware_boards.detective.settings import DetectiveSettings
from firmware_boards.detective.turning import TREADS, Turn, turn_check
from firmware_boards.tachobot.attitude import heading_check
from firmware_boards.tachobot.settings import TachobotSettings
from firmware_drivers.chips import ads1115, hmc5883l, maxbotix, md25, srf08
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings
from firmware_drivers.chips.step import Step

from firmware_runtime.board import registry
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import HalError, Implausible
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth
from sim_doubles.serial_line import SerialLineDouble
from tests.support.atomic_bench import AtomicBench
from tests.support.wire import take

DOCUMENT: Final = Path(__file__).parents[2] / "docs" / "safety.md"
BEGIN, END = "<!-- failures: written by tests/safety -->", "<!-- end of the failures -->"
MOST: Final = 1000
"""Readings after which a failure counts as one that is not found."""
BEFORE: Final = 50
"""Sound readings before it."""

Words: TypeAlias = tuple[int, ...]
Failure: TypeAlias = Callable[[Words, Words], Words]
"""What is read, of what the first reading was and what is measured now."""


def _one_frozen(first: Words, now: Words) -> Words:
    return (*now[:-1], first[-1])


def _a_bit(place: int) -> Failure:
    return lambda _, now: (*now[:-1], now[-1] | 1 << place)


def _swapped(_: Words, now: Words) -> Words:
    return (-now[-1], *now[1:-1], now[0]) if len(now) > 1 else (-now[0],)


FAILURES: Final[dict[str, Failure]] = {
    "all frozen": lambda first, _: first,
    "one axis frozen": _one_frozen,
    "zero": lambda _, now: (0,) * len(now),
    "all ones": lambda _, now: (-1,) * len(now),
    "lowest bit stuck": _a_bit(0),
    "bit 9 stuck": _a_bit(9),
    "offset jumps by 2000": lambda _, now: (*now[:-1], now[-1] + 2000),
    "scale doubled": lambda _, now: tuple(2 * word + (word >> 2 & 1) for word in now),
    "axis swapped with sign": _swapped,
}


class Words16(NamedTuple):
    """Words of 16 bits in a chip's registers, one after the other."""

    address: int
    register: int
    length: int
    order: Literal["big", "little"] = "big"


class AlteredBus(I2cBusDouble):
    """A bus whose answers have some words replaced, once there is a failure."""

    altered: Words16
    failure: Failure | None = None
    first: Words | None = None

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        data = super().transaction(address, messages)
        asked, place = messages[0], self.altered
        if self.failure is None or address != place.address or not isinstance(asked, bytes):
            return data
        begin = place.register - asked[0]
        end = begin + 2 * place.length
        if begin < 0 or end > len(data):
            return data
        now = tuple(
            int.from_bytes(data[at : at + 2], place.order, signed=True)
            for at in range(begin, end, 2)
        )
        self.first = self.first or now
        words = b"".join(
            (max(-32768, min(32767, word)) & 0xFFFF).to_bytes(2, place.order)
            for word in self.failure(self.first, now)
        )
        return data[:begin] + words + data[end:]


class Dying(ABC):
    """A chip with its driver, in motion or at rest as its name says."""

    name: str
    altered: Words16

    def __init__(self) -> None:
        self.clock = ManualClock()
        self.bus = AlteredBus("i2c1", self.clock, self.targets())
        self.bus.altered = self.altered
        self.clock.advance(SECOND)
        take(self.clock, self.bring_up())

    @property
    def is_sound(self) -> bool:
        """Whether it is not broken yet."""
        return self.bus.failure is None

    @abstractmethod
    def targets(self) -> Sequence[Target]:
        """The doubles."""

    @abstractmethod
    def bring_up(self) -> Sequence[Step]:
        """Make the driver; give its steps."""

    @abstractmethod
    def read(self) -> None:
        """Let a period pass and read. Raises HalError."""

    def break_with(self, failure: Failure) -> None:
        self.bus.failure = failure


class Inertial(Dying):
    name = "MPU-9250, acceleration, at rest"
    altered = Words16(0x68, 0x3B, 3)
    turn_rad_s = 0.0

    def targets(self) -> Sequence[Target]:
        magnetometer = Ak8963Double(self.clock, lambda at: self.truth(at).field)
        return Mpu9250Double(self.clock, self.truth, magnetometer=magnetometer).targets

    def truth(self, at: int) -> InertialTruth:
        turn = self.turn_rad_s
        angle = turn * at / SECOND
        field = (20e-6 * math.cos(angle), -20e-6 * math.sin(angle), -40e-6)
        return InertialTruth((0.0, 0.0, 9.80665), (0.0, 0.0, turn), field, 25.0)

    def bring_up(self) -> Sequence[Step]:
        settings = Mpu9250Settings(sample_hz=200, bandwidth_hz=92)
        self.chip = Mpu9250(self.bus, settings=settings)
        return self.chip.bring_up()

    def read(self) -> None:
        self.clock.advance(10 * MILLISECOND)
        self.chip.read_sample()


class Rate(Inertial):
    name = "MPU-9250, rate, at rest"
    altered = Words16(0x68, 0x43, 3)


class Field(Inertial):
    name = "AK8963 in it, at rest"
    altered = Words16(0x68, 0x4A, 3, "little")

    def read(self) -> None:
        super().read()
        if self.chip.stuck_field is not None:
            raise self.chip.stuck_field


class RateAndCompass(Inertial):
    """TachoBot's heading check on it, turning at 1 rad/s."""

    name = "MPU-9250, rate, turning, with TachoBot's compass check"
    altered = Words16(0x68, 0x43, 3)
    turn_rad_s = 1.0

    def bring_up(self) -> Sequence[Step]:
        settings = registry.load("tachobot", []).settings
        assert isinstance(settings, TachobotSettings)
        self.check = AtomicBench(heading_check(settings.controller))
        return super().bring_up()

    def read(self) -> None:
        self.clock.advance(10 * MILLISECOND)
        sample = self.chip.read_sample()
        self.check.put(self.clock() / MILLISECOND, rate=sample, value=sample)
        if self.check.faults:
            raise Implausible("check", "heading", 0.0, "as the compass")


class Cmps12Field(Dying):
    name = "CMPS12, raw field, at rest"
    altered = Words16(0x60, 6, 3)
    turn_deg_s = 0.0

    def targets(self) -> Sequence[Target]:
        return (Cmps12Double(self.clock, bearing_deg=self.bearing_deg),)

    def bearing_deg(self, at: int) -> float:
        return (90.0 + self.turn_deg_s * at / SECOND) % 360.0

    def bring_up(self) -> Sequence[Step]:
        self.chip = Cmps12(self.bus, period_ns=50 * MILLISECOND)
        return self.chip.bring_up()

    def read(self) -> None:
        self.clock.advance(50 * MILLISECOND)
        self.chip.read_bearing()


class Cmps12Bearing(Cmps12Field):
    name = "CMPS12, bearing in tenths, turning"
    altered = Words16(0x60, 2, 1)
    turn_deg_s = 30.0


class CompassAndTreads(Cmps12Field):
    """The detective's turn check on a bearing that is wrong in both its forms; its field lives."""

    name = "CMPS12, both bearings, turning, with the detective's turn check"
    altered = Words16(0, 0, 0)
    turn_deg_s = 25.0

    def bearing_deg(self, at: int) -> float:
        tenths = round(super().bearing_deg(at) * 10)
        if self.bearing_failure is None:
            return tenths / 10
        self.bus.first = self.bus.first or (tenths,)
        (altered,) = self.bearing_failure(self.bus.first, (tenths,))
        return altered / 10 % 360.0

    def targets(self) -> Sequence[Target]:
        self.bearing_failure: Failure | None = None
        return super().targets()

    def bring_up(self) -> Sequence[Step]:
        settings = registry.load("detective", []).settings
        assert isinstance(settings, DetectiveSettings)
        assert settings.turn_check is not None
        self.check = AtomicBench(turn_check("turn_check", TREADS, settings.turn_check))
        return super().bring_up()

    def break_with(self, failure: Failure) -> None:
        self.bearing_failure = failure

    def read(self) -> None:
        self.clock.advance(50 * MILLISECOND)
        turn = Turn(self.turn_deg_s, self.chip.read_bearing().bearing_deg)
        self.check.put(self.clock() / MILLISECOND, rate=turn, value=turn)
        if self.check.faults:
            raise Implausible("check", "turn", 0.0, "as commanded")


class Hmc5883l(Dying):
    name = "HMC5883L, at rest"
    altered = Words16(0x1E, 0x03, 3)

    def targets(self) -> Sequence[Target]:
        return (Hmc5883lDouble(self.clock, lambda _: (20e-6, 0.0, -40e-6)),)

    def bring_up(self) -> Sequence[Step]:
        self.chip = hmc5883l.Hmc5883l(self.bus)
        return self.chip.bring_up()

    def read(self) -> None:
        self.clock.advance(90 * MILLISECOND)
        take(self.clock, self.chip.measurement)
        self.chip.read_bearing()


class Srf08(Dying):
    name = "SRF08, before a wall"
    altered = Words16(0x70, 2, 1)

    def targets(self) -> Sequence[Target]:
        return (Srf08Double(self.clock, echoes=self.echoes),)

    def echoes(self, at: int) -> Sequence[float]:
        """Of a wall that stands still from the failure on, or nothing would be new in it."""
        return [1.5 + 0.02 * (at // SECOND % 2) * self.is_sound]

    def bring_up(self) -> Sequence[Step]:
        self.chip = srf08.Srf08(self.bus)
        return self.chip.bring_up()

    def read(self) -> None:
        self.clock.advance(66 * MILLISECOND)
        self.chip.start_ranging()
        self.clock.advance(self.chip.ranging_ns)
        self.chip.read_distance()


class Ads1115(Dying):
    name = "ADS1115, steady voltage"
    altered = Words16(0x48, 0, 1)

    def targets(self) -> Sequence[Target]:
        return (Ads1115Double(self.clock, inputs=self.inputs),)

    def inputs(self, at: int) -> Sequence[float]:
        """A voltage that is steady from the failure on."""
        return (1.0 + 1e-9 * (at % SECOND) * self.is_sound,) * 4

    def bring_up(self) -> Sequence[Step]:
        self.chip = ads1115.Ads1115(self.bus)
        return self.chip.bring_up()

    def read(self) -> None:
        take(self.clock, self.chip.measurement("AIN0"))
        self.chip.read_voltage()


class Md25(Dying):
    name = "MD25, encoders, driving"
    altered = Words16(0x58, 2, 4)

    def targets(self) -> Sequence[Target]:
        return (Md25Double(self.clock),)

    def bring_up(self) -> Sequence[Step]:
        self.chip = md25.Md25(self.bus)
        return self.chip.bring_up()

    def read(self) -> None:
        self.clock.advance(500 * MILLISECOND)
        self.chip.set_speeds(0.5, 0.5)


class Maxbotix(Dying):
    """Its words are the distances in cm; there is no bus between."""

    name = "MaxBotix XL, before a wall"
    altered = Words16(0, 0, 0)

    def targets(self) -> Sequence[Target]:
        self.failure: Failure | None = None
        self.double = MaxbotixDouble(self.clock, self.distance, family="xl")
        return ()

    def distance(self, _at: int) -> float:
        if self.failure is None:
            return 1.5
        (count,) = self.failure((150,), (150,))
        return count / 100 if count >= 0 else math.inf  # what it says of no echo is all nines

    def bring_up(self) -> Sequence[Step]:
        line = SerialLineDouble("ttyS0", self.clock, self.double)
        self.chip = maxbotix.Maxbotix(line, "xl")
        return self.chip.bring_up()

    def break_with(self, failure: Failure) -> None:
        self.failure = failure

    def read(self) -> None:
        self.double.catch_up()
        self.chip.start_ranging()
        self.clock.advance(self.chip.ranging_ns)
        self.chip.read_distance()


CHIPS: Final[tuple[type[Dying], ...]] = (
    *(Inertial, Rate, RateAndCompass, Field),
    *(Cmps12Field, Cmps12Bearing, CompassAndTreads, Hmc5883l, Srf08, Maxbotix, Ads1115, Md25),
)


def found_after(chip: type[Dying], failure: Failure) -> int | None:
    """Readings until the driver says that something is wrong; None if it never does.

    A failure that begins is reported within those readings; before it none is.
    """
    dying = chip()
    for _ in range(BEFORE):
        dying.read()
    dying.break_with(failure)
    for reading in range(1, MOST + 1):
        try:
            dying.read()
        except HalError:
            return reading
    return None


def table() -> list[str]:
    """The rows of the table, as the page has them."""
    head = ["| chip, and what of it | " + " | ".join(FAILURES) + " |", "|---" * 10 + "|"]
    return head + [
        f"| {chip.name} | "
        + " | ".join(str(found_after(chip, each) or "no") for each in FAILURES.values())
        + " |"
        for chip in CHIPS
    ]
