"""The ADS1115's driver and the model that reads its inputs in turn, on its double."""

import pytest
from firmware_drivers.analog_inputs import AnalogInputs, AnalogInputsSettings, Voltages
from firmware_drivers.chips.ads1115 import (
    CODES_OF_FULL_SCALES,
    CODES_OF_INPUTS,
    CODES_OF_RATES,
    SAME_BEFORE_PROOF,
    Ads1115,
    Ads1115Settings,
)

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import Fault, NotReady, Stuck, WrongDevice
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, ForcedRegister, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.virtual_bus import VirtualBus
from tests.support.wire import take


class Rig:
    """A driver, brought up on its double."""

    def __init__(self, rate_error: float = 0.0, settings: Ads1115Settings | None = None) -> None:
        self.clock = ManualClock()
        self.volts = [1.0, 0.25, 0.0, 3.0]
        double = Ads1115Double(self.clock, inputs=lambda _: self.volts, rate_error=rate_error)
        self.bus = I2cBusDouble("i2c-1", self.clock, [double])
        self.driver = Ads1115(self.bus, settings=settings)
        take(self.clock, self.driver.bring_up())

    def start(self, inputs: str, share: float = 1.0) -> None:
        for step in self.driver.measurement(inputs):
            step.action()
            self.clock.advance(round(step.wait_ns * share))

    def is_not_ready(self, reason: str) -> None:
        with pytest.raises(NotReady, match=reason):
            self.driver.read_voltage()


@pytest.fixture
def rig() -> Rig:
    return Rig()


def test_the_bytes_of_one_conversion(rig: Rig) -> None:
    rig.start("AIN0")
    rig.driver.read_voltage()
    sent = [str(each) for each in list(rig.bus.log)[-3:]]
    assert [each.partition(", R")[0] for each in sent] == [
        "0x48 W 01 c5 87",
        "0x48 W 01",
        "0x48 W 00",
    ]


def test_the_slowest_converter_has_its_code_in_time() -> None:
    rig = Rig(rate_error=-0.09)
    rig.start("AIN0")
    assert rig.driver.read_voltage() == pytest.approx(1.0, abs=1e-4)


def test_a_code_is_read_once_and_not_before_its_time(rig: Rig) -> None:
    rig.start("AIN1", share=0.5)
    rig.is_not_ready("expected OS set")
    rig.clock.advance(10_000_000)
    assert rig.driver.read_voltage() == pytest.approx(0.25, abs=1e-4)
    rig.is_not_ready("no conversion|expected")


@pytest.mark.parametrize("full_scale_v", CODES_OF_FULL_SCALES)
def test_the_voltage_of_all_inputs_is_the_same_at_every_full_scale(full_scale_v: float) -> None:
    rig = Rig(settings=Ads1115Settings(full_scale_v=full_scale_v))
    rig.volts = [0.01, 0.03, 0.09, 0.21]
    for inputs in CODES_OF_INPUTS:
        plus, _, minus = inputs.replace("AIN", "").partition("-")
        rig.start(inputs)
        expected = rig.volts[int(plus)] - (rig.volts[int(minus)] if minus else 0.0)
        assert rig.driver.read_voltage() == pytest.approx(expected, abs=2e-4)


@pytest.mark.parametrize("rate_sps", CODES_OF_RATES)
def test_a_conversion_takes_as_long_as_its_rate_says(rate_sps: int) -> None:
    rig = Rig(settings=Ads1115Settings(rate_sps=rate_sps))
    rig.start("AIN0", share=0.8)
    rig.is_not_ready("expected OS set")
    rig.clock.advance(round(0.2 * rig.driver.conversion_ns))
    assert rig.driver.read_voltage() == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(("inputs", "code"), [("AIN3", "7fff"), ("AIN0-AIN3", "8000")])
def test_a_voltage_beyond_the_full_scale_is_no_reading(rig: Rig, inputs: str, code: str) -> None:
    rig.volts[3] = 3.3
    rig.start(inputs)
    rig.is_not_ready(rf"{code}; expected .* 2\.048 V")


def test_a_chip_that_lost_power_during_a_conversion_is_not_read(rig: Rig) -> None:
    rig.start("AIN0-AIN1", share=0.5)
    rig.bus.power_cycle()
    rig.clock.advance(20_000_000)
    rig.is_not_ready("8583")


def test_a_conversion_from_before_a_bring_up_is_not_read(rig: Rig) -> None:
    rig.start("AIN0")
    take(rig.clock, rig.driver.bring_up())
    rig.is_not_ready("no conversion to read")


@pytest.mark.parametrize(("volts", "proofs"), [(3.0, 1), (4.5, 0), (0.001, 0)])
def test_a_code_that_stands_still_is_proved_by_another_scale_in_which_it_fits(
    rig: Rig, volts: float, proofs: int
) -> None:
    rig.driver = Ads1115(rig.bus, settings=Ads1115Settings(full_scale_v=6.144))
    take(rig.clock, rig.driver.bring_up())
    rig.volts[0] = volts
    rig.bus.log.clear()
    for _ in range(SAME_BEFORE_PROOF + 1):
        rig.start("AIN0")
        assert rig.driver.read_voltage() == pytest.approx(volts, abs=2e-4)
    begun = [each.written for each in rig.bus.log if each.written[:1] == b"\x01"]
    assert sum(len(each) == 3 and each[1] & 0x0E == 0x02 for each in begun) == proofs


def test_a_code_that_hangs_is_stuck_from_its_proof_on(rig: Rig) -> None:
    rig.volts[0] = 0.0
    rig.bus.faults = FaultScript([ForcedRegister(address=0x48, register=0, value=0x12)])
    for _ in range(SAME_BEFORE_PROOF):
        rig.start("AIN0")
        assert rig.driver.read_voltage() == pytest.approx(0x1200 / 0x8000 * 2.048)
    for same in (1, 2, 3):
        rig.start("AIN0")
        with pytest.raises(Stuck, match=f"in {SAME_BEFORE_PROOF + same} readings in a row"):
            rig.driver.read_voltage()
    rig.bus.faults = None
    rig.start("AIN0")
    assert rig.driver.read_voltage() == pytest.approx(0.0, abs=1e-4)


def test_thresholds_of_another_program_are_no_identity(rig: Rig) -> None:
    rig.driver.identify()
    rig.bus.write(0x48, b"\x02\x12\x34")
    with pytest.raises(WrongDevice, match="1234"):
        rig.driver.identify()


def test_every_wrong_setting_is_named(rig: Rig) -> None:
    settings = Ads1115Settings(full_scale_v=5.0, rate_sps=100)
    with pytest.raises(SettingError, match=r"address: 0x50.*full_scale_v: 5\.0.*rate_sps: 100"):
        Ads1115(rig.bus, 0x50, settings)
    with pytest.raises(SettingError, match=r"'AIN3-AIN0'.*AIN0-AIN3"):
        rig.driver.measurement("AIN3-AIN0")


# The model that reads its inputs in turn ---------------------------------------------------------


class Model:
    """The model on the chip's double, in a simulator's time."""

    def __init__(self, inputs: tuple[str, ...] = ("AIN0", "AIN1", "AIN3"), ms: int = 50) -> None:
        self.volts = [0.5, 1.0, -0.25, 2.0]
        self.rig = VirtualBus()
        self.double = self.rig.connect(Ads1115Double, inputs=lambda _at: self.volts)
        chip = Ads1115(self.rig.bus, settings=Ads1115Settings(full_scale_v=2.048, rate_sps=250))
        self.model = AnalogInputs("adc", chip, AnalogInputsSettings(inputs, ms * MILLISECOND))
        self._said = self.rig.simulate([self.model], self.model.voltages, self.model.fault_out)

    @property
    def voltages(self) -> list[Voltages]:
        return [value for _, value in self._said if isinstance(value, Voltages)]

    @property
    def faults(self) -> list[Fault]:
        return [value for _, value in self._said if isinstance(value, Fault)]


def test_every_input_is_read_once_a_period_and_differences_with_their_sign() -> None:
    model = Model()
    model.rig.run(SECOND)
    assert (model.faults, model.double.warnings) == ([], [])
    assert model.voltages[0].volts == pytest.approx((0.5, 1.0, 2.0), abs=1e-4)
    assert len(model.voltages) == 17  # after 0.14 s of bring-up
    model = Model(("AIN2-AIN3", "AIN0-AIN1"))
    model.volts[3] = 0.0
    model.rig.run(300 * MILLISECOND)
    assert model.voltages[0].volts == pytest.approx((-0.25, -0.5), abs=1e-4)


def test_a_chip_that_lost_its_supply_is_brought_up_again_and_nothing_is_made_up() -> None:
    model = Model()
    model.rig.run(500 * MILLISECOND)
    seen = len(model.voltages)
    model.double.power_cycle()
    model.volts[0] = 0.75
    model.rig.run(2 * SECOND)
    assert model.faults != []
    assert all(each.volts[0] == pytest.approx(0.75, abs=1e-4) for each in model.voltages[seen:])
    assert model.model.unready() is None


def test_a_conversion_that_cannot_be_begun_is_a_fault() -> None:
    model = Model()
    model.rig.run(520 * MILLISECOND)
    assert model.model.phase == "resting"
    model.rig.doubles.faults = FaultScript([NackAddress(address=0x48, times=3)])
    model.rig.run(600 * MILLISECOND)
    assert [fault.kind for fault in model.faults] == ["NoAcknowledge"]


@pytest.mark.parametrize(
    ("volts", "fault", "kind", "is_ready"),
    [
        pytest.param(
            1.0, NackAddress(address=0x48, times=None), "NoAcknowledge", False, id="silent"
        ),
        pytest.param(3.0, NackAddress(times=0), "NotReady", None, id="beyond the scale"),
        pytest.param(-0.5, NackAddress(times=0), "Implausible", None, id="below ground"),
    ],
)
def test_a_chip_that_gives_no_voltage_is_a_fault_and_no_reading(
    volts: float, fault: NackAddress, kind: str, *, is_ready: bool | None
) -> None:
    model = Model()
    model.rig.doubles.faults = FaultScript([fault])
    model.volts[1] = volts
    model.rig.run(SECOND)
    assert model.voltages == []
    assert {fault.kind for fault in model.faults} == {kind}
    assert is_ready is None or (model.model.unready() is None) == is_ready


@pytest.mark.parametrize(("inputs", "ms"), [((), 50), (("AIN0",) * 4, 10), (("AIN7",), 50)])
def test_what_cannot_be_measured_in_time_is_refused(inputs: tuple[str, ...], ms: int) -> None:
    with pytest.raises(SettingError):
        Model(inputs, ms)
