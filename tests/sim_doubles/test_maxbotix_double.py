"""The MaxBotix sonar's double by bytes; every expected value is worked out by hand."""

import math

import pytest

from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.clock import ManualClock

MICROSECOND = 1_000
MILLISECOND = 1_000_000
SECOND = 1_000_000_000
BANNER = b"XL-MaxSonar-EZ\rMaxBotix Inc.\rRoHS 1.0\r"


class Surroundings:
    """How far the nearest target is, and when that was asked for."""

    def __init__(self) -> None:
        self.distance_m = 1.234
        self.asked_at: list[int] = []

    def __call__(self, at: int) -> float:
        self.asked_at.append(at)
        return self.distance_m


@pytest.fixture
def surroundings() -> Surroundings:
    return Surroundings()


@pytest.fixture
def sonar(clock: ManualClock, surroundings: Surroundings) -> MaxbotixDouble:
    return MaxbotixDouble(clock, surroundings)


def test_a_banner_comes_first_and_then_a_frame_every_cycle(
    sonar: MaxbotixDouble, clock: ManualClock, surroundings: Surroundings
) -> None:
    clock.advance(250 * MILLISECOND)
    assert sonar.transmitted(clock()) == BANNER
    clock.advance(100 * MILLISECOND - 1)
    sonar.transmitted(clock())
    clock.advance(1)
    surroundings.distance_m = 2.0
    assert sonar.transmitted(clock()) == b"\r"
    clock.advance(100 * MILLISECOND)
    assert sonar.transmitted(clock()) == b"R200\r"
    assert surroundings.asked_at == [(250 + n * 100) * MILLISECOND for n in range(3)]


def test_bytes_arrive_one_by_one_at_9600_baud(sonar: MaxbotixDouble) -> None:
    begin = 350 * MILLISECOND - 5_208_333  # five bytes of 1041.67 us
    sonar.transmitted(begin)
    assert sonar.transmitted(begin + 1_041_665) == b""
    assert sonar.transmitted(begin + 1_041_666) == b"R"
    assert sonar.transmitted(begin + 4_000_000) == b"12"
    assert sonar.transmitted(begin + 5_208_333) == b"3\r"


@pytest.mark.parametrize(
    ("family", "distance_m", "frame", "period_ms"),
    [
        ("xl", 1.234, b"R123\r", 100),
        ("xl", 0.05, b"R020\r", 100),
        ("xl", 7.64, b"R764\r", 100),
        ("xl", 7.66, b"R765\r", 100),
        ("xl", math.inf, b"R765\r", 100),
        ("lv", 1.234, b"R049\r", 50),
        ("lv", 0.0, b"R006\r", 50),
        ("lv", math.inf, b"R255\r", 50),
        ("hrlv", 1.234, b"R1234\r", 100),
        ("hrlv", 0.2, b"R0300\r", 100),
        ("hrlv", 5.1, b"R5000\r", 100),
        ("hrlv", math.nan, b"R5000\r", 100),
    ],
)
def test_families_differ_in_unit_digits_limits_and_rate(
    clock: ManualClock, family: str, distance_m: float, frame: bytes, period_ms: int
) -> None:
    sonar = MaxbotixDouble(clock, lambda _: distance_m, family=family)
    sonar.transmitted(250 * MILLISECOND)
    assert sonar.transmitted((250 + period_ms) * MILLISECOND) == frame
    assert sonar.transmitted((250 + 10 * period_ms) * MILLISECOND) == 9 * frame


def test_after_a_long_silence_the_last_64_pings_count(
    sonar: MaxbotixDouble, clock: ManualClock, surroundings: Surroundings
) -> None:
    clock.advance(24 * 3600 * SECOND)
    sonar.catch_up()
    assert sonar.pings == 64
    assert surroundings.asked_at[-1] == 24 * 3600 * SECOND - 50 * MILLISECOND
    clock.advance(49 * MILLISECOND)
    assert sonar.transmitted(clock()) == 63 * b"R123\r" + b"R123"


def test_catching_up_asks_the_world_before_it_moves_on(
    sonar: MaxbotixDouble, clock: ManualClock, surroundings: Surroundings
) -> None:
    clock.advance(300 * MILLISECOND)
    sonar.catch_up()
    surroundings.distance_m = 5.0
    clock.advance(100 * MILLISECOND)
    assert sonar.transmitted(clock()).endswith(b"R123\r")


def test_a_power_cycle_cuts_the_frame_and_sends_the_banner_again(
    sonar: MaxbotixDouble, clock: ManualClock
) -> None:
    clock.advance(349 * MILLISECOND)
    assert sonar.transmitted(clock()).endswith(b"R123")
    sonar.power_cycle()
    clock.advance(349 * MILLISECOND)
    assert sonar.transmitted(clock()) == BANNER + b"R123"


def test_rs232_polarity_reads_as_garbage(clock: ManualClock) -> None:
    sonar = MaxbotixDouble(clock, lambda _: 1.23, inverted=True)
    begin = 350 * MILLISECOND - 5_208_333
    sonar.transmitted(begin)
    # the line falls after R's first two bits: 1 1 0 1 0 1 0 1 follow, and so on
    assert sonar.transmitted(begin + 1_250_000) == b"\xab"
    garbage = sonar.transmitted(350 * MILLISECOND)
    assert garbage[:1] == b"\xb6"
    assert b"R" not in garbage
    assert len(garbage) < 5


def test_bytes_for_the_sonar_are_ignored_with_a_warning(
    sonar: MaxbotixDouble, clock: ManualClock
) -> None:
    sonar.receive(b"R\r")
    clock.advance(350 * MILLISECOND)
    assert sonar.transmitted(clock()) == BANNER + b"R123\r"
    assert sonar.warnings == [
        "XL-MaxSonar: bytes 52 0d sent to the RX pin; it takes a level, no data"
    ]


def test_an_unknown_family_is_refused(clock: ManualClock) -> None:
    with pytest.raises(ValueError, match=r"family is 'hr', expected one of \['lv', 'xl', 'hrlv'\]"):
        MaxbotixDouble(clock, lambda _: 1.0, family="hr")
