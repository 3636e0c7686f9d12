"""The SRF08's double by bytes; every expected value is worked out by hand."""

import math

import pytest

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import ManualClock
from tests.support.wire import WiredChip, sentences

PING = "W 00 51"  # in centimetres
SEQUENCE = "W 00 a0; W 00 aa; W 00 a5"
FULL_RANGE = "max_gain is 1025; farthest_m is 11.008"


class Wired(WiredChip[Srf08Double]):
    """A sonar before echoes that tests set, and the instants at which they were asked for."""

    def __init__(self, clock: ManualClock) -> None:
        self.distances = [1.234, 2.5]
        self.asked_at: list[int] = []
        chip = Srf08Double(clock, 0x75, echoes=self._echoes, light=77, revision=6)
        super().__init__(clock, chip, 0x75, [chip])

    def _echoes(self, at: int) -> list[float]:
        self.asked_at.append(at)
        return self.distances

    def ranged(self, command: int = 0x51) -> bytes:
        """Range once and read all 36 registers when it is over."""
        self.write(0x00, command)
        self.wait(65)
        return self.read(0x00, 36)


@pytest.fixture
def sonar(clock: ManualClock) -> Wired:
    return Wired(clock)


@sentences(
    {
        "power-up has full range, full gain and no echo": f"W 00, R 06 00*35 ff; {FULL_RANGE}",
        "echoes are read once at the instant of the ping": (
            f"3 ns; {PING}; 65 ms; W 00, R 06 4d 00 7b 00 fa; asked_at is [3]; pings is 1"
        ),
        "gain 0 is 94": "W 01 00; max_gain is 94",
        "gain 16 is 177": "W 01 10; max_gain is 177",
        "gain 31 is 1025": "W 01 1f; max_gain is 1025",
        "a gain above 31 is warned of": ("W 01 20; max_gain is 1025; warns gain 32 written"),
        "ranging begins at STOP, so one write may set gain and range too": (
            "W 00 51 00 17; max_gain is 94; farthest_m is 1.032; 6 ms; W 02, R 00 00"
        ),
        "pings closer than 65 ms are warned of": (
            f"{PING}; 65 ms; {PING}; 64.999 ms; {PING}; warns ranging 64.999 ms after the last"
        ),
        "a sonar that ranges misses a general call": (
            f"{PING}; 63 ms; 0x00 W 00 51 -> refused; pings is 1"
        ),
        "a general call is not answered for reading": "0x00 R 00 -> refused",
        "a software reset of other chips does nothing": "0x00 W 06; ranging is False",
        "the address changes by its sequence and stays over a power cycle": (
            f"{SEQUENCE}; W 00 e6; power cycle; 0x73 W 00, R 06; W 00, R 06 -> refused"
        ),
        "a write in between breaks the address sequence off": (
            "W 00 a0; W 00 aa; W 01 05; W 00 a5; W 00 e6; address is 0x75; "
            "warns sequence broken off after 2 bytes; warns command 0xa5 does not exist; "
            "warns command 0xe6 does not exist"
        ),
        "a sequence in one write is no sequence": (
            "W 00 a0 aa a5 e6; address is 0x75; warns sequence broken off after 1 bytes; "
            "warns gain 170 written; warns register 0x03 is read-only"
        ),
        "a broken sequence may start over at once": (
            f"W 00 a0; {SEQUENCE}; W 00 fe; address is 0x7f; warns broken off"
        ),
        "an odd new address is ignored": (
            f"{SEQUENCE}; W 00 e7; address is 0x75; warns not an even number from 0xe0 to 0xfe"
        ),
        "a new address below 0xe0 is ignored": (
            f"{SEQUENCE}; W 00 de; address is 0x75; warns not an even number from 0xe0 to 0xfe"
        ),
        "a power cycle ends ranging and forgets settings": (
            f"W 01 00 10; {PING}; 65 ms; {PING}; power cycle; W 00, R 06 00 00 00; {FULL_RANGE}"
        ),
        "echo registers are read-only": "W 03 12; warns register 0x03 is read-only",
    }
)
def test_registers_and_commands(sonar: Wired, lines: str) -> None:
    sonar.play(lines)


@pytest.mark.parametrize(
    ("command", "first", "second"),
    [
        (0x50, b"\x00\x31", b"\x00\x62"),  # 48.58 and 98.43 inches
        (0x51, b"\x00\x7b", b"\x00\xfa"),  # 123.4 and 250 cm
        (0x52, b"\x1c\x06", b"\x38\xc7"),  # 7174.4 and 14534.9 us
    ],
)
def test_echoes_come_big_endian_in_the_unit_of_the_command(
    sonar: Wired, command: int, first: bytes, second: bytes
) -> None:
    assert sonar.ranged(command) == bytes([6, 77]) + first + second + bytes(30)


@pytest.mark.parametrize(
    ("distances", "place", "read"),
    [
        pytest.param([math.inf], 2, bytes(34), id="no echo reads zero"),
        pytest.param(
            [0.5 * n for n in range(1, 20)], 34, (850).to_bytes(2, "big"), id="seventeen are kept"
        ),
        pytest.param([0.004, 0.029, 0.031], 2, b"\x00\x03\x00\x00", id="from three centimetres on"),
    ],
)
def test_echoes_that_are_seen(
    sonar: Wired, distances: list[float], place: int, read: bytes
) -> None:
    sonar.ranged()
    sonar.distances = distances
    assert sonar.ranged()[place : place + len(read)] == read


def test_range_register_cuts_what_is_farther(sonar: Wired) -> None:
    sonar.distances = [6.019, 6.021]  # (139 + 1) x 43 mm = 6.020 m
    sonar.play("W 02 8b; farthest_m is 6.02", PING, "65 ms; W 02, R 02 5a 00 00")


@pytest.mark.parametrize(
    ("range_register", "busy_ms"), [(255, 64), (139, 35), (0, 0.25), (93, 23.5)]
)
def test_chip_is_silent_while_ranging_for_a_time_that_follows_the_range(
    sonar: Wired, range_register: int, busy_ms: float
) -> None:
    sonar.play(f"W 02 {range_register:02x}", PING, f"{busy_ms * 1e6 - 1:.0f} ns; ranging is True")
    sonar.play("W 00, R 06 -> refused; warns written to while ranging; 1 ns; ranging is False")
    sonar.play("W 00, R 06")


def test_general_call_ranges_every_sonar_on_the_bus(sonar: Wired) -> None:
    sonar.bus.connect(Srf08Double(sonar.clock, 0x73, echoes=lambda _: [3.0]))
    sonar.play("0x00 W 00 51; W 00 -> refused; warns written to; 0x73 W 00 -> refused; 64 ms")
    sonar.play("0x73 W 02, R 01 2c; W 02, R 00 7b")


@pytest.mark.parametrize(
    ("command", "distances", "nearest", "slots"),
    [
        (0x54, [0.3, 3.0, 10.95], b"\x00\x1e", [0, 8, 31]),  # slots of 352 mm
        (0x55, [], bytes(2), []),
    ],
)
def test_ann_mode_marks_the_slots_in_which_echoes_came(
    sonar: Wired, command: int, distances: list[float], nearest: bytes, slots: list[int]
) -> None:
    sonar.distances = distances
    registers = sonar.ranged(command)
    assert registers[2:4] == nearest
    assert [slot for slot in range(32) if registers[4 + slot]] == slots


def test_a_sonar_left_at_0x70_puts_a_pca9685_to_sleep_with_its_clock_gone(
    clock: ManualClock,
) -> None:
    pwm = Pca9685Double(clock, 0x40)
    wired = WiredChip(clock, pwm, 0x40, [pwm, Srf08Double(clock, echoes=lambda _: [])])
    wired.play("0x70 W 00 51; warns EXTCLK set; W 00, R 51")  # EXTCLK, SLEEP, ALLCALL
    wired.play("W 00 01; warns EXTCLK written 0; W 00, R 41; running is False")
