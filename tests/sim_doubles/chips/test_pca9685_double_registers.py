"""PCA9685 double: reset values, pointer, auto-increment, reserved registers, addresses, resets."""

import pytest

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.wire import sentences
from tests.support.wired_pca9685 import WiredPca9685

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


@pytest.mark.parametrize("address", [0x3F, 0x70, 0x80])
def test_address_a_pca9685_cannot_have_is_refused(clock: ManualClock, address: int) -> None:
    with pytest.raises(ValueError, match="expected 0x40 to 0x7f without 0x70"):
        Pca9685Double(clock, address)


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
