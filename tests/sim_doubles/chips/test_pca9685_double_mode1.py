"""PCA9685 double: sleep, RESTART, the sticky external clock, and the trap at address 0x70."""

import pytest

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from tests.support.wire import sentences
from tests.support.wired_pca9685 import WiredPca9685

HALF_ON_ALL, QUARTER_ON_ALL = "W fa 00 00 00 08", "W fa 00 00 00 04"
HALVES, ALL_OFF = "duties is 0.5*16", "all_off is True"
SLEEP, WAKE, RESTART = "W 00 31", "W 00 21", "W 00 a1"
SOFTWARE_RESET = "0x00 W 06"
TOO_EARLY = "warns within 500 us of waking"
INTERRUPTED = f"{HALF_ON_ALL}; {SLEEP}; W 00, R b1; {WAKE}; 500 us"
"""Put to sleep while its channels ran, and woken again."""
EXTCLK_LATCHED = "W 00 51; warns EXTCLK set"


@sentences(
    {
        "LED registers take values asleep, but outputs stay off": (
            f"W 00 31; {HALF_ON_ALL}; {ALL_OFF}; {WAKE}; {HALVES}"
        ),
        "an LED write within 500 us of waking is warned of": (
            f"{WAKE}; 499.999 us; {HALF_ON_ALL}; {TOO_EARLY}; 1 ns; {QUARTER_ON_ALL}"
        ),
        "one sonar ping at 0x70 is enough for a chip asleep": (
            "0x70 W 00 51; warns EXTCLK set; W 00, R 51"
        ),
        "an external clock set asleep sticks and stops outputs": (
            f"{EXTCLK_LATCHED}; {WAKE}; warns EXTCLK written 0; {HALF_ON_ALL}; {TOO_EARLY}; "
            f"W 00, R 61; {ALL_OFF}; frequency_hz is 0.0"
        ),
        "a software reset clears the external clock": (
            f"{EXTCLK_LATCHED}; W 00 11; warns EXTCLK written 0; W 00, R 51; {SOFTWARE_RESET}; "
            "W 00, R 11"
        ),
        "a power cycle clears the external clock": (f"{EXTCLK_LATCHED}; power cycle; W 00, R 11"),
    }
)
def test_asleep(asleep: WiredPca9685, lines: str) -> None:
    asleep.play(lines)


@sentences(
    {
        "sleep with all channels full-off sets no RESTART": f"{SLEEP}; W 00, R 31",
        "an orderly shutdown before sleep sets no RESTART": (
            f"{HALF_ON_ALL}; W fd 10; {SLEEP}; W 00, R 31"
        ),
        "outputs wait for RESTART after waking": (
            f"{INTERRUPTED}; W 00, R a1; {ALL_OFF}; running is False"
        ),
        "RESTART resumes outputs after 500 us and reads zero": (
            f"{INTERRUPTED}; {RESTART}; W 00, R 21; {HALVES}"
        ),
        "RESTART written zero does nothing": f"{INTERRUPTED}; {WAKE}; W 00, R a1; {ALL_OFF}",
        "RESTART within 500 us is ignored and warned of": (
            f"{INTERRUPTED}; {SLEEP}; {WAKE}; 499.999 us; {RESTART}; W 00, R a1; "
            "warns RESTART written within 500 us"
        ),
        "RESTART in the byte that wakes is accepted without effect": (
            f"{INTERRUPTED}; {SLEEP}; {RESTART}; W 00, R a1; {ALL_OFF}; warns RESTART written"
        ),
        "an LED write and STOP withdraw a pending RESTART": (
            f"{INTERRUPTED}; W 06 00 00 00 04; W 00, R 21; duties is 0.25 0.5*15"
        ),
        "with OCH only four registers of a channel withdraw a RESTART": (
            f"{INTERRUPTED}; W 01 0c; W 06 00 00 00; W 00, R a1; W 09 04; W 00, R 21; "
            "duties is 0.25 0.5*15"
        ),
        "a software reset clears a pending RESTART": (
            f"{INTERRUPTED}; {SOFTWARE_RESET}; W 00, R 11"
        ),
        "a power cycle clears a pending RESTART": f"{INTERRUPTED}; power cycle; W 00, R 11",
        "an external clock is ignored awake": "W 00 61; W 00, R 21; warns EXTCLK written awake",
        # a sonar's "range in cm" is register 0 <- 0x51; RESTART, SLEEP, ALLCALL, not yet EXTCLK
        "a first sonar ping at 0x70 puts an awake chip to sleep": (
            f"{HALF_ON_ALL}; 0x70 W 00 51; {ALL_OFF}; W 00, R 91; warns EXTCLK written awake"
        ),
        "a second sonar ping at 0x70 latches the external clock": (
            f"{HALF_ON_ALL}; 0x70 W 00 51; warns EXTCLK written awake; 0x70 W 00 51; "
            f"warns EXTCLK set; W 00, R d1; {WAKE}; warns EXTCLK written 0; 1 ms; {HALF_ON_ALL}; "
            f"W 00, R 61; {ALL_OFF}"
        ),
        "a sonar ping passes by once all-call is off": (
            f"W 00 20; {HALF_ON_ALL}; 0x70 W 00 51 -> refused; {HALVES}"
        ),
    }
)
def test_awake(awake: WiredPca9685, lines: str) -> None:
    awake.play(lines)


def test_sleep_stops_every_output_and_advances_the_world_first(awake: WiredPca9685) -> None:
    awake.play(HALF_ON_ALL, "W 0a 00 10 00 00")  # channel 1 full-on
    awake.before.clear()
    awake.play(SLEEP, ALL_OFF, "running is False")
    assert awake.before == [(0.5, 1.0, *(0.5,) * 14)]


def test_an_external_clock_that_is_there_sets_the_frequency(clock: ManualClock) -> None:
    pca = WiredPca9685(clock, Pca9685Double(clock, external_clock_hz=4096 * 31 * 100.0))
    pca.play(EXTCLK_LATCHED, "W 00 61; 1 ms", HALF_ON_ALL, HALVES)
    assert pca.chip.frequency_hz == pytest.approx(100.0)
