"""The MaxBotix sonar's double by bytes; every expected value is worked out by hand."""

import math

import pytest

from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.clock import ManualClock

MILLISECOND = 1_000_000
SECOND = 1_000_000_000
BANNER = b"XL-MaxSonar-EZ\rMaxBotix Inc.\rRoHS 1.0\r"


class Wired:
    """A sonar before a target, and the instants at which its distance was asked for."""

    def __init__(self, *, inverted: bool = False) -> None:
        self.clock = ManualClock()
        self.distance_m = 1.234
        self.asked_at: list[int] = []
        self.chip = MaxbotixDouble(self.clock, self._distance, inverted=inverted)

    def _distance(self, at: int) -> float:
        self.asked_at.append(at)
        return self.distance_m

    def sent(self, after_ns: int) -> bytes:
        """What it sent by then."""
        self.clock.advance(after_ns)
        return self.chip.transmitted(self.clock())


@pytest.fixture
def sonar() -> Wired:
    return Wired()


def test_a_banner_comes_first_and_then_a_frame_every_cycle(sonar: Wired) -> None:
    assert sonar.sent(250 * MILLISECOND) == BANNER
    sonar.sent(100 * MILLISECOND - 1)
    sonar.distance_m = 2.0
    assert sonar.sent(1) == b"\r"
    assert sonar.sent(100 * MILLISECOND) == b"R200\r"
    assert sonar.asked_at == [(250 + n * 100) * MILLISECOND for n in range(3)]


def test_bytes_arrive_one_by_one_at_9600_baud(sonar: Wired) -> None:
    sonar.sent(350 * MILLISECOND - 5_208_333)  # five bytes of 1041.67 us
    spans = (1_041_665, 1, 2_958_334, 1_208_333)
    assert [sonar.sent(span) for span in spans] == [b"", b"R", b"12", b"3\r"]


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
        ("xl-10m", 9.99, b"R999\r", 100),
        ("xl-10m", 10.67, b"R1067\r", 100),
        ("xl-10m", math.inf, b"R1068\r", 100),
        ("hrxl-5m", 0.2, b"R0300\r", SECOND / 7e6),
        ("hrxl-5m", math.inf, b"R5000\r", SECOND / 7e6),
        ("hrxl-10m", 0.2, b"R0500\r", SECOND / 7e6),
        ("hrxl-10m", math.inf, b"R9999\r", SECOND / 7e6),
    ],
)
def test_families_differ_in_unit_digits_limits_and_rate(
    clock: ManualClock, family: str, distance_m: float, frame: bytes, period_ms: float
) -> None:
    sonar = MaxbotixDouble(clock, lambda _: distance_m, family=family)
    sonar.transmitted(250 * MILLISECOND)
    assert sonar.transmitted(int((250 + period_ms) * MILLISECOND)) == frame
    assert sonar.transmitted(int((250 + 10 * period_ms) * MILLISECOND)) == 9 * frame


def test_after_a_long_silence_the_last_64_pings_count(sonar: Wired) -> None:
    day = 24 * 3600 * SECOND
    sonar.clock.advance(day)
    sonar.chip.catch_up()
    assert sonar.chip.pings == 64
    assert sonar.asked_at[-1] == day - 50 * MILLISECOND
    sonar.distance_m = 5.0  # the world is asked before it moves on
    assert sonar.sent(49 * MILLISECOND) == 63 * b"R123\r" + b"R123"


def test_frames_of_four_digits_are_kept_whole(clock: ManualClock) -> None:
    sonar = MaxbotixDouble(clock, lambda _: 10.5, family="xl-10m")
    clock.advance(3600 * SECOND)
    assert sonar.transmitted(clock()).count(b"R1050\r") == 63


def test_a_power_cycle_cuts_the_frame_and_sends_the_banner_again(sonar: Wired) -> None:
    assert sonar.sent(349 * MILLISECOND).endswith(b"R123")
    sonar.chip.power_cycle()
    assert sonar.sent(349 * MILLISECOND) == BANNER + b"R123"


def test_rs232_polarity_reads_as_garbage() -> None:
    sonar = Wired(inverted=True)
    sonar.distance_m = 1.23
    sonar.sent(350 * MILLISECOND - 5_208_333)
    # the line falls after R's first two bits: 1 1 0 1 0 1 0 1 follow, and so on
    assert sonar.sent(1_250_000) == b"\xab"
    garbage = sonar.sent(5_208_333 - 1_250_000)
    assert garbage[:1] == b"\xb6"
    assert b"R" not in garbage
    assert len(garbage) < 5


def test_bytes_for_the_sonar_are_ignored_with_a_warning(sonar: Wired) -> None:
    sonar.chip.receive(b"R\r")
    assert sonar.sent(350 * MILLISECOND) == BANNER + b"R123\r"
    (warning,) = sonar.chip.warnings
    assert "bytes 52 0d sent to the RX pin" in warning
