"""PCA9685 double: registers, addresses, sleep, RESTART, the external clock, outputs."""

import pytest

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.wire import sentences
from tests.support.wired_pca9685 import WiredPca9685


@pytest.fixture
def asleep(clock: ManualClock) -> WiredPca9685:
    """Return the chip as after power-up."""
    return WiredPca9685(clock)


@pytest.fixture
def awake(asleep: WiredPca9685) -> WiredPca9685:
    """Return the chip awake, auto-increment on, its oscillator stable."""
    asleep.play("W 00 21; 1 ms")
    return asleep


POWERED_UP = "11 04 e2 e4 e8 e0"


@sentences(
    {
        "without auto-increment a burst hits one register": (
            "W 06 ff 7f 00 10; W 06, R 10; W 07, R 00"
        ),
        "a burst may set auto-increment and go on": "W 00 31 05 aa; W 00, R 31 05 aa",
        "the pointer is zero after power-up": "R 11 11",
        "test mode takes nothing and is warned of": "W ff 55; W ff, R 00; warns TestMode",
        "PRE_SCALE below three is three": "W fe 00; W fe, R 03",
        "all-call answers at 0x70 from power-up until disabled": (
            "0x70 W 00, R 11; W 00 10; 0x70 W 00 -> refused"
        ),
        "all-call moves with its register": "W 05 aa; 0x55 W 00, R 11; 0x70 W 00 -> refused",
        "a general call read is not acknowledged": "0x00 R 00 -> refused",
    }
)
def test_registers_asleep(asleep: WiredPca9685, lines: str) -> None:
    asleep.play(lines)


@sentences(
    {
        "reserved bits read zero": "W 01 ff*9; W 01, R 1f fe fe fe fe ff 1f ff 1f",
        "a burst that clears auto-increment stays at MODE1": "W 00 01 11; W 00, R 11; W 01, R 04",
        "a read without pointer goes on where the last access ended": "W 02, R e2; R e4 e8",
        "auto-increment goes from the last channel to MODE1": "W 44, R 00 10 21 04",
        "auto-increment goes from ALL_LED through PRE_SCALE to MODE1": "W fa, R 00*4 1e 21",
        "ALL_LED registers copy into every channel and read zero": (
            f"W fa 01 02 03 04; W 06, R {'01 02 03 04 ' * 16}; W fa, R 00*4"
        ),
        "PRE_SCALE is ignored unless asleep": (
            "W fe 05; W fe, R 1e; warns PRE_SCALE written awake"
        ),
        "a general call with another byte resets nothing": "0x00 W 05 -> refused; W 00, R 21",
        "a general call with the byte twice resets nothing": "0x00 W 06 06 -> refused; W 00, R 21",
        "a general call with a byte more resets nothing": "0x00 W 06 00 -> refused; W 00, R 21",
        "register six is no software reset": "W 06 00; W 00, R 21",
        "a power cycle restores power-up values": "W 01 14; power cycle; W 00, R 11; W 01, R 04",
    }
)
def test_registers_awake(awake: WiredPca9685, lines: str) -> None:
    awake.play(lines)


def test_power_up_values_are_those_of_the_data_sheet(asleep: WiredPca9685) -> None:
    values = b"".join(asleep.read(number) for number in range(0x46))
    assert values == bytes.fromhex(POWERED_UP) + b"\x00\x00\x00\x10" * 16
    asleep.play("W fe, R 1e")


@pytest.mark.parametrize("reserved", ["46", "80", "f9"])
def test_reserved_register_is_not_acknowledged_and_leaves_the_pointer(
    awake: WiredPca9685, reserved: str
) -> None:
    awake.play(f"W 03; W {reserved} 55 -> refused; R e4; warns reserved register")


@pytest.mark.parametrize(
    ("pre_scale", "frequency_hz"),
    [(3, 1525.88), (5, 1017.25), (14, 406.90), (30, 196.89), (121, 50.03), (255, 23.84)],
)
def test_frequency_follows_pre_scale(
    asleep: WiredPca9685, pre_scale: int, frequency_hz: float
) -> None:
    asleep.write(0xFE, pre_scale)
    assert asleep.chip.frequency_hz == pytest.approx(frequency_hz, abs=0.005)


def test_frequency_follows_the_true_oscillator(clock: ManualClock) -> None:
    # 26 MHz / (4096 * 31)
    assert Pca9685Double(clock, true_osc_hz=26e6).frequency_hz == pytest.approx(204.76, abs=0.005)


# Addresses


@pytest.mark.parametrize(("enable", "address"), [("18", "71"), ("14", "72"), ("12", "74")])
def test_sub_address_answers_once_enabled(asleep: WiredPca9685, enable: str, address: str) -> None:
    asleep.play(f"0x{address} W 00 -> refused; W 00 {enable}; 0x{address} W 01, R 04")


@sentences(
    {
        "all-call writes every chip and reads their AND": (
            "W 02 f0; 0x41 W 02 3c; 0x70 W 02, R 30; 0x70 W 02 aa; W 02, R aa; 0x41 W 02, R aa"
        ),
        "a software reset by general call resets every chip": (
            "W 00 21 1f; 0x41 W 00 21 1f; 1 ms; W 09 00; 0x41 W 09 00; 0x00 W 06; "
            "W 00, R 11; W 01, R 04; W 09, R 10; 0x41 W 00, R 11; 0x41 W 01, R 04; 0x41 W 09, R 10"
        ),
    }
)
def test_two_chips(asleep: WiredPca9685, lines: str) -> None:
    chips = [asleep.chip, Pca9685Double(asleep.clock, 0x41)]
    asleep.bus = I2cBusDouble("i2c-1", asleep.clock, chips)
    asleep.play(lines)


def test_software_reset_waits_for_stop(awake: WiredPca9685) -> None:
    assert awake.chip.start(0x00, read=False)
    assert awake.chip.write(0x06)
    awake.chip.start(0x40, read=False)  # a repeated START aborts it
    awake.chip.stop()
    awake.play("W 00, R 21")


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


HALF, QUARTER = "00 00 00 08", "00 00 00 04"


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
