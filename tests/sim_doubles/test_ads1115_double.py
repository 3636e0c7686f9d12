"""The ADS1115's double by bytes; every expected value is worked out by hand."""

import pytest

from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.clock import ManualClock
from tests.support.wire import WiredChip, sentences

WAKE_UP = 25_000
POWERED_UP = "W 00, R 00 00; W 01, R 85 83; W 02, R 80 00; W 03, R 7f ff"
START = "W 01 c3 83"
"""A single conversion of AIN0 at 128 samples a second, 4.096 V full scale."""
ONE_V, TWO_V, THREE_V = "W 00, R 1f 40", "W 00, R 3e 80", "W 00, R 5d c0"
UNDER_WAY, DONE = "W 01, R 43 83", "W 01, R c3 83"


class Wired(WiredChip[Ads1115Double]):
    """A converter with voltages that tests set."""

    def __init__(self, rate_error: float = 0.0) -> None:
        clock = ManualClock()
        self.volts = [1.0, 0.25, 0.0, 3.0]
        chip = Ads1115Double(clock, inputs=lambda _: self.volts, rate_error=rate_error)
        super().__init__(clock, chip, 0x48, [chip])

    def convert(self, config: int) -> int:
        self.write(1, config >> 8, config & 0xFF)
        self.wait(200)
        return int.from_bytes(self.read(0, 2), "big")


@sentences(
    {
        "registers at power-up": POWERED_UP,
        "a start during a conversion does nothing but is noted": (
            f"{START}; 4 ms; {START}; 4 ms; {DONE}; warns OS written 1"
        ),
        "the conversion register is read-only": "W 00 12 34; W 00, R 00 00; warns read-only",
        "thresholds read back what was written": (
            "W 02 12 34; W 03 56 78; W 02, R 12 34; W 03, R 56 78"
        ),
        "half a word is not taken": "W 02 12; W 02, R 80 00; warns ",
        "the pointer stays and has two bits": (
            "W 03, R 7f ff 7f ff; R 7f ff; W 06, R 80 00; warns "
        ),
        "a general call with 06h resets": (
            f"W 02 12 34; {START}; 0x00 W 04; W 02, R 12 34; 0x00 W 06; {POWERED_UP}; "
            "0x00 R 00 -> refused"
        ),
        "a loss of power ends the conversion": f"{START}; power cycle; 200 ms; {POWERED_UP}",
    }
)
def test_registers(lines: str) -> None:
    Wired().play(lines)


def test_a_long_silence_costs_one_conversion(clock: ManualClock) -> None:
    asked_at: list[int] = []

    def inputs(at: int) -> list[float]:
        asked_at.append(at)
        return [1.0, 0.0, 0.0, 0.0]

    chip = Ads1115Double(clock, inputs=inputs)
    WiredChip(clock, chip, 0x48, [chip]).play("W 01 c2 83; 1 s", ONE_V, "3600 s", ONE_V)
    assert len(asked_at) < 4


@pytest.mark.parametrize(
    ("code", "rate"), list(enumerate((8, 16, 32, 64, 128, 250, 475, 860))), ids=str
)
def test_a_single_conversion_takes_its_time_by_the_rate(code: int, rate: int) -> None:
    rig, low = Wired(), 0x03 | code << 5
    rig.play(f"W 01 c3 {low:02x}; {WAKE_UP + round(1e9 / rate) - 1} ns")
    rig.play(f"W 01, R 43 {low:02x}; W 00, R 00 00; 1 ns; W 01, R c3 {low:02x}", ONE_V)


def test_a_slow_converter_takes_longer() -> None:
    due = f"{WAKE_UP + round(1e9 / 128)} ns"
    Wired(rate_error=-0.1).play(START, due, UNDER_WAY, "1 ms", DONE)


@pytest.mark.parametrize(
    ("mux", "volts"), list(enumerate((0.75, -2.0, -2.75, -3.0, 1.0, 0.25, 0.0, 3.0)))
)
def test_the_multiplexer_chooses_inputs(mux: int, volts: float) -> None:
    assert Wired().convert(0x8383 | mux << 12) == round(volts / 4.096 * 0x8000) & 0xFFFF


@pytest.mark.parametrize(
    ("gain", "full_scale"),
    list(enumerate((6.144, 4.096, 2.048, 1.024, 0.512, 0.256, 0.256, 0.256))),
)
def test_the_full_scale_is_the_gains(gain: int, full_scale: float) -> None:
    rig = Wired()
    rig.volts[0] = full_scale / 2
    assert rig.convert(0xC183 | gain << 9) == 0x4000


def test_codes_stop_at_the_ends_of_the_scale_and_conversions_go_on() -> None:
    rig = Wired()
    rig.volts[:2] = 5.0, 10.0
    assert rig.convert(0xC383) == 0x7FFF
    assert rig.convert(0x8383) == 0x8000
    rig = Wired()
    rig.play(f"W 01 42 83; {WAKE_UP + round(1e9 / 128)} ns", ONE_V, "W 01, R 42 83")  # AIN0
    rig.volts[0] = 2.0
    rig.play("5 ms; W 01 72 83; 3 ms", TWO_V, "8 ms", THREE_V, "10 s")  # AIN3
    rig.volts[3] = 2.0
    rig.play("8 ms", TWO_V)
