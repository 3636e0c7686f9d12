import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

ADDRESS = 0x48
MILLISECOND = 1_000_000
WAKE_UP = 25_000
AIN0_128_SPS = 0xC383  # a single conversion, 4.096 V full scale is PGA 001


class Rig:
    """A double on a bus, with registers as words."""

    def __init__(self, rate_error: float = 0.0) -> None:
        self.clock = ManualClock()
        self.volts = [1.0, 0.25, 0.0, 3.0]
        self.double = Ads1115Double(self.clock, inputs=lambda _: self.volts, rate_error=rate_error)
        self.bus = I2cBusDouble("i2c-1", self.clock, [self.double])

    def read(self, register: int) -> int:
        return int.from_bytes(self.bus.write_read(ADDRESS, bytes((register,)), 2), "big")

    def write(self, register: int, word: int) -> None:
        self.bus.write(ADDRESS, bytes((register, word >> 8, word & 0xFF)))

    def convert(self, config: int) -> int:
        self.write(1, config)
        self.clock.advance(200 * MILLISECOND)
        return self.read(0)


def test_registers_at_power_up() -> None:
    rig = Rig()
    assert [rig.read(each) for each in range(4)] == [0x0000, 0x8583, 0x8000, 0x7FFF]


@pytest.mark.parametrize(
    ("code", "rate"), list(enumerate((8, 16, 32, 64, 128, 250, 475, 860))), ids=str
)
def test_a_single_conversion_takes_its_time_by_the_rate(code: int, rate: int) -> None:
    rig = Rig()
    rig.write(1, 0xC303 | code << 5)
    rig.clock.advance(WAKE_UP + round(1e9 / rate) - 1)
    assert not rig.read(1) & 0x8000
    assert rig.read(0) == 0
    rig.clock.advance(1)
    assert rig.read(1) & 0x8000
    assert rig.read(0) == round(1.0 / 4.096 * 0x8000)


def test_a_slow_converter_takes_longer() -> None:
    rig = Rig(rate_error=-0.1)
    rig.write(1, AIN0_128_SPS)
    rig.clock.advance(WAKE_UP + round(1e9 / 128))
    assert not rig.read(1) & 0x8000
    rig.clock.advance(1 * MILLISECOND)
    assert rig.read(1) & 0x8000


@pytest.mark.parametrize(
    ("mux", "volts"),
    list(enumerate((0.75, -2.0, -2.75, -3.0, 1.0, 0.25, 0.0, 3.0))),
)
def test_the_multiplexer_chooses_inputs(mux: int, volts: float) -> None:
    rig = Rig()
    code = rig.convert(0x8383 | mux << 12)
    assert code == round(volts / 4.096 * 0x8000) & 0xFFFF


@pytest.mark.parametrize(
    ("gain", "full_scale"),
    list(enumerate((6.144, 4.096, 2.048, 1.024, 0.512, 0.256, 0.256, 0.256))),
)
def test_the_full_scale_is_the_gains(gain: int, full_scale: float) -> None:
    rig = Rig()
    rig.volts[0] = full_scale / 2
    assert rig.convert(0xC183 | gain << 9) == 0x4000


def test_codes_stop_at_the_ends_of_the_scale() -> None:
    rig = Rig()
    rig.volts[0] = 5.0
    assert rig.convert(AIN0_128_SPS) == 0x7FFF
    rig.volts[1] = 10.0
    assert rig.convert(0x8383) == 0x8000


def test_continuous_conversion_goes_on_and_changes_settings_with_the_next_one() -> None:
    rig = Rig()
    rig.write(1, 0x4283)  # continuous, AIN0, 128 samples a second
    rig.clock.advance(WAKE_UP + round(1e9 / 128))
    assert rig.read(0) == round(1.0 / 4.096 * 0x8000)
    assert not rig.read(1) & 0x8000
    rig.volts[0] = 2.0
    rig.clock.advance(5 * MILLISECOND)
    rig.write(1, 0x7283)  # AIN3
    rig.clock.advance(3 * MILLISECOND)
    assert rig.read(0) == round(2.0 / 4.096 * 0x8000)
    rig.clock.advance(8 * MILLISECOND)
    assert rig.read(0) == round(3.0 / 4.096 * 0x8000)
    rig.clock.advance(10_000 * MILLISECOND)
    rig.volts[3] = 1.5
    rig.clock.advance(8 * MILLISECOND)
    assert rig.read(0) == round(1.5 / 4.096 * 0x8000)


def test_a_start_during_a_conversion_does_nothing_but_is_noted() -> None:
    rig = Rig()
    rig.write(1, AIN0_128_SPS)
    rig.clock.advance(4 * MILLISECOND)
    rig.write(1, AIN0_128_SPS)
    rig.clock.advance(4 * MILLISECOND)
    assert rig.read(1) & 0x8000
    assert len(rig.double.warnings) == 1


def test_the_conversion_register_is_read_only() -> None:
    rig = Rig()
    rig.write(0, 0x1234)
    assert rig.read(0) == 0
    assert len(rig.double.warnings) == 1


def test_thresholds_read_back_what_was_written() -> None:
    rig = Rig()
    rig.write(2, 0x1234)
    rig.write(3, 0x5678)
    assert (rig.read(2), rig.read(3)) == (0x1234, 0x5678)


def test_half_a_word_is_not_taken() -> None:
    rig = Rig()
    rig.bus.write(ADDRESS, b"\x02\x12")
    assert rig.read(2) == 0x8000
    assert len(rig.double.warnings) == 1


def test_the_pointer_stays_and_has_two_bits() -> None:
    rig = Rig()
    assert rig.bus.write_read(ADDRESS, b"\x03", 4) == b"\x7f\xff\x7f\xff"
    assert rig.bus.read(ADDRESS, 2) == b"\x7f\xff"
    assert rig.read(0x06) == 0x8000
    assert len(rig.double.warnings) == 1


def test_a_general_call_with_06h_resets() -> None:
    rig = Rig()
    rig.write(2, 0x1234)
    rig.write(1, AIN0_128_SPS)
    rig.bus.write(0x00, b"\x04")
    assert rig.read(2) == 0x1234
    rig.bus.write(0x00, b"\x06")
    assert [rig.read(each) for each in range(4)] == [0x0000, 0x8583, 0x8000, 0x7FFF]
    with pytest.raises(NoAcknowledge):
        rig.bus.read(0x00, 1)


def test_a_loss_of_power_ends_the_conversion() -> None:
    rig = Rig()
    rig.write(1, AIN0_128_SPS)
    rig.bus.power_cycle()
    rig.clock.advance(200 * MILLISECOND)
    assert [rig.read(each) for each in range(4)] == [0x0000, 0x8583, 0x8000, 0x7FFF]
