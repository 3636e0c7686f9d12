"""The driver beside its row in the contract of all chips: settings, and what is no reading."""

import pytest
from firmware_drivers.chips.ads1115 import Ads1115, Ads1115Settings

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import NotReady, WrongDevice
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble


class Bench:
    """A driver with default settings, brought up on its double."""

    def __init__(self, rate_error: float = 0.0) -> None:
        self.clock = ManualClock()
        self.volts = [1.0, 0.25, 0.0, 3.0]
        self.double = Ads1115Double(self.clock, inputs=lambda _: self.volts, rate_error=rate_error)
        self.bus = I2cBusDouble("i2c-1", self.clock, [self.double])
        self.driver = Ads1115(self.bus)
        for step in self.driver.bring_up():
            step.action()
            self.clock.advance(step.wait_ns)

    def start(self, inputs: str, share: float = 1.0) -> None:
        for step in self.driver.measurement(inputs):
            step.action()
            self.clock.advance(round(step.wait_ns * share))


def test_the_bytes_of_one_conversion() -> None:
    bench = Bench()
    bench.start("AIN0")
    bench.driver.read_voltage()
    assert [each.messages for each in list(bench.bus.log)[-3:]] == [
        (b"\x01\xc5\x87",),
        (b"\x01", 2),
        (b"\x00", 2),
    ]


def test_the_slowest_converter_has_its_code_in_time() -> None:
    bench = Bench(rate_error=-0.09)
    bench.start("AIN0")
    assert bench.driver.read_voltage() == pytest.approx(1.0, abs=1e-4)


def test_a_code_is_read_once() -> None:
    bench = Bench()
    bench.start("AIN1")
    bench.driver.read_voltage()
    with pytest.raises(NotReady):
        bench.driver.read_voltage()


def test_a_conversion_under_way_is_not_ready_and_can_be_read_later() -> None:
    bench = Bench()
    bench.start("AIN1", share=0.5)
    with pytest.raises(NotReady, match="expected OS set"):
        bench.driver.read_voltage()
    bench.clock.advance(10_000_000)
    assert bench.driver.read_voltage() == pytest.approx(0.25, abs=1e-4)


@pytest.mark.parametrize(("inputs", "code"), [("AIN3", "7fff"), ("AIN0-AIN3", "8000")])
def test_a_voltage_beyond_the_full_scale_is_no_reading(inputs: str, code: str) -> None:
    bench = Bench()
    bench.volts[3] = 3.3
    bench.start(inputs)
    with pytest.raises(NotReady, match=rf"{code}; expected .* 2\.048 V"):
        bench.driver.read_voltage()


def test_a_chip_that_lost_power_during_a_conversion_is_not_read() -> None:
    bench = Bench()
    bench.start("AIN0-AIN1", share=0.5)
    bench.bus.power_cycle()
    bench.clock.advance(20_000_000)
    with pytest.raises(NotReady, match="8583"):
        bench.driver.read_voltage()


def test_thresholds_of_another_program_are_no_identity() -> None:
    bench = Bench()
    bench.driver.identify()
    bench.bus.write(0x48, b"\x02\x12\x34")
    with pytest.raises(WrongDevice, match="1234"):
        bench.driver.identify()


def test_every_wrong_setting_is_named() -> None:
    bus = I2cBusDouble("i2c-1", ManualClock(), [])
    settings = Ads1115Settings(full_scale_v=5.0, rate_sps=100)
    with pytest.raises(SettingError, match=r"address: 0x50.*full_scale_v: 5\.0.*rate_sps: 100"):
        Ads1115(bus, 0x50, settings)


def test_inputs_that_cannot_be_chosen_are_refused() -> None:
    driver = Ads1115(I2cBusDouble("i2c-1", ManualClock(), []))
    with pytest.raises(SettingError, match=r"'AIN3-AIN0'.*AIN0-AIN3"):
        driver.measurement("AIN3-AIN0")
