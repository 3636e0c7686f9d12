"""The MD25's double by bytes; every expected value is worked out by hand."""

import math
from struct import unpack

import pytest

from sim_doubles.chips.md25 import Md25Double
from sim_doubles.clock import ManualClock
from tests.support.wire import UNITS, WiredChip, sentences

COUNT_RAD = math.tau / 360
SIGNED = "W 0f 01"
TIMEOUT_OFF, TIMEOUT_ON = "W 10 32", "W 10 33"
AHEAD, AHEAD_BOTH, AHEAD_AND_BACK = "W 00 ff", "W 00 ff ff", "W 00 ff 00"
FULL, STILL = "units is 127 127", "units is 0 0"
LOOK = "W 0d, R 03"
"""A read of the software version, which keeps the timeout off."""


class Wired(WiredChip[Md25Double]):
    """An MD25 of which a unit of speed turns the motor by one encoder count a second."""

    def __init__(self, clock: ManualClock, full_speed_rad_s: float = 127 * COUNT_RAD) -> None:
        chip = Md25Double(
            clock,
            full_speed_rad_s=full_speed_rad_s,
            battery_v=12.34,
            currents_a=(0.52, 2.8),
            version=3,
        )
        super().__init__(clock, chip, 0x58, [chip])

    @property
    def units(self) -> tuple[float, float]:
        """The speeds in units of the registers."""
        first, second = self.chip.speeds_rad_s
        return first / COUNT_RAD, second / COUNT_RAD

    @property
    def encoders(self) -> tuple[int, ...]:
        return unpack(">2i", self.read(0x02, 8))

    def talk(self, span: int) -> None:
        """Let time pass with a look at the chip every second."""
        while span > 0:
            self.clock.advance(min(span, UNITS["s"]))
            self.play(LOOK)
            span -= UNITS["s"]


@pytest.fixture
def motors(clock: ManualClock) -> Wired:
    return Wired(clock)


@sentences(
    {
        "power-up values": "W 00, R 80 80 00*8 7b 05 1c 03 05 00 00 00",
        # 5 a step, every 25 ms: 127 and -8 are asked for
        "speed steps by the acceleration every 25 ms": (
            "W 00 ff 78; 24.999999 ms; units is 0 0; 1 ns; units is 5 -5; 25 ms; units is 10 -8; "
            "600 ms; units is 127 -8"
        ),
        "a new acceleration counts for a ramp under way": (
            f"{AHEAD}; 30 ms; W 0e 0a; 20 ms; units is 15 0"
        ),
        # 11.25 in ten steps, then 100 in a second
        "encoders count degrees of the output": (
            "W 0e 0a; W 00 e4 1c; 1.25 s; encoders is 111 -112"
        ),
        "encoders reset to zero": (
            f"{AHEAD_AND_BACK}; 1 s; W 10 20; encoders is 0 0; 1 s; encoders is 127 -128"
        ),
        # 111, and 211 a second later
        "an encoder is captured when its first byte is read": (
            "W 0e 0a; W 00 e4 e4; 1.25 s; W 03, R 00*3; W 02, R 00; 1 s; W 03, R 00 00 6f; "
            "W 06, R 00 00 00 d3"
        ),
        "after the timeout motors wait for a new speed": (
            f"{SIGNED}; W 00 64 64; 2 s; W 00, R 00 00; 1 s; {STILL}; W 00 64 64; 1 s; "
            "units is 100 100"
        ),
        "traffic to other chips does not put the timeout off": (
            f"{AHEAD_BOTH}; 1 s; 0x59 W 00 -> refused; 1 s; {STILL}"
        ),
        "the timeout can be switched off and on": (
            f"{TIMEOUT_OFF}; {AHEAD_BOTH}; 3600 s; {FULL}; {TIMEOUT_ON}; 2 s; {STILL}"
        ),
        "a new mode stops the motors, and the same mode does not": (
            f"{SIGNED}; W 00 64 9c; 1 s; {SIGNED}; units is 100 -100; W 0f 02; {STILL}; "
            f"W 00, R 80 80; 1 s; {STILL}"
        ),
        "regulation is switched by commands": (
            "regulated is True; W 10 30; regulated is False; W 10 31; regulated is True"
        ),
        "the address changes by its sequence and stays over a power cycle": (
            "W 10 a0; W 10 aa; W 10 a5; W 10 b4; power cycle; 0x5a W 0d, R 03; W 0d -> refused"
        ),
        "a speed in between breaks the address sequence off": (
            "W 10 a0; W 10 aa; W 00 80; W 10 a5; W 10 b4; address is 0x58; "
            "warns sequence broken off after 2 bytes; warns 0xa5; warns 0xb4"
        ),
    }
)
def test_registers_and_motors(motors: Wired, lines: str) -> None:
    motors.play(lines)


def test_an_emg30_turns_170_times_a_minute_at_full_speed(clock: ManualClock) -> None:
    chip = Md25Double(clock)
    WiredChip(clock, chip, 0x58, [chip]).play(AHEAD, "1 s")
    assert chip.speeds_rad_s[0] == pytest.approx(math.tau * 170 / 60, rel=1e-3)


def test_battery_and_currents_are_what_the_world_says(motors: Wired) -> None:
    motors.chip.battery_v, motors.chip.currents_a = 30.0, (-1.0, 0.04)
    motors.play("W 0a, R ff 00 00")


@pytest.mark.parametrize(
    ("mode", "first", "second", "speeds"),
    [
        (0, 255, 0, "127 -128"),
        (0, 128, 129, "0 1"),
        (1, 127, 0x80, "127 -128"),
        (1, 0, 0xFF, "0 -1"),
        (2, 178, 138, "40 60"),  # 50 forward, turn 10
        (2, 78, 138, "-40 -60"),  # 50 backward, turn 10
        (3, 0, 20, "-20 20"),
        (3, 100, 100, "-73 127"),  # 0 and 200 asked for: the difference is kept
        (3, 0x9C, 100, "72 -128"),  # 0 and -200 asked for
        (3, 127, 0x80, "127 -128"),  # 255 and -1 asked for: the difference is out of reach
    ],
)
def test_modes_give_the_bytes_their_meaning(
    motors: Wired, mode: int, first: int, second: int, speeds: str
) -> None:
    asked = f"{first:02x} {second:02x}"
    motors.play(f"W 0f {mode:02x}; W 00 {asked}; 1.9 s; units is {speeds}; W 00, R {asked}")


@pytest.mark.parametrize(("acceleration", "steps"), [(1, 255), (3, 85), (5, 51), (10, 26)])
def test_full_reverse_to_full_forward_takes_its_number_of_steps(
    motors: Wired, acceleration: int, steps: int
) -> None:
    motors.play(f"W 0e {acceleration:02x}; W 00 00")
    motors.talk(4 * UNITS["s"])
    motors.play(AHEAD)
    motors.talk((steps - 1) * 25 * UNITS["ms"])
    assert motors.units[0] < 127
    motors.play("25 ms; units is 127 0")


def test_writing_the_same_speed_again_does_not_hold_the_ramp_up(motors: Wired) -> None:
    motors.play(*[AHEAD, "10 ms"] * 100, "units is 127 0")


def test_turn_is_the_exact_integral_over_the_ramp(motors: Wired) -> None:
    # 25 ms at each of 5, 10 to 125, then 127 from 650 ms on; backwards 128 instead
    motors.play(AHEAD_AND_BACK, "1 s")
    first, second = motors.chip.turned_rad(motors.clock())
    assert first / COUNT_RAD == pytest.approx(0.025 * 1625 + 0.35 * 127)
    assert second / COUNT_RAD == pytest.approx(-0.025 * 1625 - 0.35 * 128)


def test_encoders_wrap_at_32_bits(clock: ManualClock) -> None:
    motors = Wired(clock, full_speed_rad_s=127 * 360e6 * COUNT_RAD)
    motors.play(TIMEOUT_OFF, "W 00 81; 6.025 s")
    assert abs(motors.encoders[0] - (6 * 360_000_000 - (1 << 32))) <= 1


def test_two_seconds_of_silence_stop_the_motors(motors: Wired) -> None:
    motors.play(AHEAD_BOTH, "1.999999999 s", FULL, "1 ns", STILL)
    turned = motors.chip.turned_rad(motors.clock())
    motors.play("3600 s")
    assert motors.chip.turned_rad(motors.clock()) == turned
    assert turned[0] / COUNT_RAD == pytest.approx(0.025 * 1625 + 1.35 * 127)


def test_any_traffic_to_the_chip_puts_the_timeout_off(motors: Wired) -> None:
    motors.play(AHEAD_BOTH)
    motors.talk(10 * UNITS["s"])
    motors.play("1.999999999 s", FULL, "1 ns", STILL)


def test_before_version_2_the_timeout_cannot_be_switched(clock: ManualClock) -> None:
    chip = Md25Double(clock, version=1)
    motors = WiredChip(clock, chip, 0x58, [chip])
    motors.play(TIMEOUT_OFF, "warns command 0x32 does not exist", AHEAD_BOTH)
    motors.play("2 s; speeds_rad_s is 0 0")


@pytest.mark.parametrize(
    ("register", "value"), [(15, 4), (14, 0), (14, 11), (2, 0), (13, 9), (17, 1)]
)
def test_what_cannot_be_written_is_ignored_with_a_warning(
    motors: Wired, register: int, value: int
) -> None:
    warning = f"warns register {register} written {value};"
    motors.play(f"W {register:02x} {value:02x}; {warning} W 0d, R 03 05 00 00")


def test_a_power_cycle_stops_the_motors_and_forgets_settings(motors: Wired) -> None:
    motors.play(SIGNED, "W 0e 0a", TIMEOUT_OFF, "W 00 64 64; 10 s")
    turned = motors.chip.turned_rad(motors.clock())
    motors.play("power cycle", STILL, "encoders is 0 0; W 0e, R 05 00")
    assert motors.chip.turned_rad(motors.clock()) == turned
    motors.play(AHEAD, "2 s", STILL)


def test_the_world_advances_before_the_timeout_or_a_command_changes_its_course(
    motors: Wired,
) -> None:
    speeds: list[float] = []

    def advance_world() -> None:
        stretches = list(motors.chip.motors.stretches(0, motors.clock()))
        speeds.append(sum(s.speeds_rad_s[0] * (s.until - s.since) for s in stretches))

    motors.chip.motors.before_change = advance_world
    motors.play(AHEAD, "5 s", LOOK)
    assert speeds == [0, pytest.approx((0.025 * 1625 + 1.35 * 127) * COUNT_RAD * 1e9)]


def test_its_content_is_what_is_read(motors: Wired) -> None:
    motors.play("W 00 ff; 1 s")
    content = motors.chip.content
    assert motors.read(0x00, 17) == content
