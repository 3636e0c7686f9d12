"""PCA9685 double: what the load sees, and when it changes."""

import pytest

from tests.support.wire import sentences
from tests.support.wired_pca9685 import WiredPca9685

HALF, QUARTER = "00 00 00 08", "00 00 00 04"
HALF_ON_ALL, HALVES = f"W fa {HALF}", "duties is 0.5*16"


@pytest.mark.parametrize(
    ("counts", "duty"),
    [
        ("00 00 00 08", 0.5),  # ON 0, OFF 2048
        ("99 01 cc 04", 0.199951171875),  # ON 409, OFF 1228: 819 / 4096
        ("00 0c 00 04", 0.5),  # ON 3072, OFF 1024: across the wrap
        ("ff 0f 00 00", 1 / 4096),  # ON 4095, OFF 0
        ("01 00 00 00", 4095 / 4096),  # ON 1, OFF 0
        ("00 10 00 00", 1.0),  # full-on
        ("00 10 00 08", 1.0),  # full-on, OFF count ignored
        ("00 00 00 18", 0.0),  # full-off, OFF count ignored
        ("00 10 00 10", 0.0),  # full-off wins over full-on
    ],
)
def test_duty_follows_counts_and_flags(awake: WiredPca9685, counts: str, duty: float) -> None:
    awake.play(f"W 0a {counts}; duties is 0 {duty} 0*14")
    assert awake.chip.duty(1) == duty


@sentences(
    {
        "equal counts are off, and warned of once": (
            f"W 0a 34 02 34 02; W 0e {HALF}; duties is 0*2 0.5 0*13; "
            "warns channel 1 has ON == OFF == 564"
        ),
        "with OCH a lone register changes nothing": (
            f"W 01 0c; W 06 {HALF}; W 09 04; duties is 0.5 0*15"
        ),
        # the count is lost
        "a stop of three bytes takes all channels off": (
            f"{HALF_ON_ALL}; {HALVES}; W fd 10; all_off is True; W 09, R 10"
        ),
        "INVRT inverts the duty": f"W 06 {QUARTER}; W 01 14; duties is 0.75 1*15",
        "open drain never drives high": f"W 06 {QUARTER}; W 01 00; all_off is True",
        "power-up is asleep and low": "power cycle; all_off is True; running is False",
    }
)
def test_outputs(awake: WiredPca9685, lines: str) -> None:
    awake.play(lines)


def test_a_stop_of_three_bytes_is_29_bits(awake: WiredPca9685) -> None:
    bits = awake.bus.bits
    awake.play("W fd 10")
    assert awake.bus.bits - bits == 29


def test_outputs_go_on_after_the_bus_is_closed(awake: WiredPca9685) -> None:
    awake.play(HALF_ON_ALL)
    awake.bus.close()
    awake.play(HALVES, "running is True")


# When they change


def test_the_world_is_advanced_before_each_change_and_by_nothing_else(awake: WiredPca9685) -> None:
    awake.play(f"W 06 {' '.join([HALF] * 8)}; W 06 {' '.join([QUARTER] * 8)}")
    assert awake.before == [(0.0,) * 16, (0.5,) * 8 + (0.0,) * 8]
    awake.play(f"duties is 0.25*8 0*8; W 06 {' '.join([QUARTER] * 8)}; W 05 e0")
    assert len(awake.before) == 2


def test_four_single_writes_pass_through_torn_values(awake: WiredPca9685) -> None:
    awake.play("W 06 00 00 80 00; W 06 00; W 07 00; W 08 10; W 09 02")
    assert [duties[0] for duties in awake.before] == [0.0, 128 / 4096, 16 / 4096]
    assert awake.chip.duty(0) == 528 / 4096


def test_outputs_change_at_stop_and_not_before(awake: WiredPca9685) -> None:
    awake.chip.start(0x40, read=False)
    for byte in b"\x06\x00\x00\x00\x08":
        awake.chip.write(byte)
    assert awake.chip.duty(0) == 0.0
    awake.chip.stop()
    assert awake.chip.duty(0) == 0.5


def test_with_och_a_channel_changes_at_its_fourth_acknowledge(awake: WiredPca9685) -> None:
    awake.play("W 01 0c")
    awake.chip.start(0x40, read=False)
    for byte in b"\x06\x00\x00\x00":
        awake.chip.write(byte)
    assert awake.chip.duty(0) == 0.0
    awake.chip.write(0x08)
    assert awake.chip.duty(0) == 0.5
    for byte in b"\x00\x00\x00":
        awake.chip.write(byte)
    awake.chip.stop()
    assert awake.chip.duty(1) == 0.0


def test_a_power_cycle_and_oe_advance_the_world_first(awake: WiredPca9685) -> None:
    awake.play(HALF_ON_ALL)
    awake.before.clear()
    awake.chip.output_enabled = False
    awake.chip.output_enabled = True
    awake.play("power cycle")
    assert awake.before == [(0.5,) * 16, (0.0,) * 16, (0.5,) * 16]


# OE


@pytest.mark.parametrize(
    ("mode2", "level"), [("04", 0), ("05", 1), ("01", 0), ("06", 0), ("07", 0), ("14", 0)]
)
def test_oe_high_takes_outputs_to_what_outne_says_and_invrt_does_not_apply(
    awake: WiredPca9685, mode2: str, level: int
) -> None:
    awake.play(f"W 01 {mode2}", HALF_ON_ALL)
    awake.chip.output_enabled = False
    awake.play(f"duties is {level}*16")


def test_invrt_applies_again_once_oe_is_low(awake: WiredPca9685) -> None:
    awake.play("W 01 14")
    awake.chip.output_enabled = False
    awake.chip.output_enabled = True
    awake.play("duties is 1*16")


def test_oe_high_holds_asleep_too(asleep: WiredPca9685) -> None:
    asleep.play("W 01 05")
    asleep.chip.output_enabled = False
    asleep.play("running is False; duties is 1*16")
