"""Inputs of an ADS1115 read in turn, on its double."""

import pytest
from firmware_drivers.analog_inputs import AnalogInputs, AnalogInputsSettings, Voltages
from firmware_drivers.chips.ads1115 import Ads1115, Ads1115Settings

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.accounted_bus import AccountedBus, RetryPolicy
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.clock import FollowingClock
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble

TRUE_V = (0.5, 1.0, -0.25, 2.0)


class Rig:
    """The model on the chip's double, in a simulator's time."""

    def __init__(self, inputs: tuple[str, ...] = ("AIN0", "AIN1", "AIN3"), ms: int = 50) -> None:
        self.simulator: Simulator | None = None
        self.voltages: list[Voltages] = []
        self.faults: list[Fault] = []
        self.clock = FollowingClock(self._now)
        self.volts = list(TRUE_V)
        self.double = Ads1115Double(self.clock, inputs=lambda _at: self.volts)
        self.wire = I2cBusDouble("i2c1", self.clock, [self.double], reach=self.clock.reach)
        bus = AccountedBus(self.wire, 400_000, RetryPolicy(1), time=self.clock)
        chip = Ads1115(bus, settings=Ads1115Settings(full_scale_v=2.048, rate_sps=250))
        top = Coupled("top")
        settings = AnalogInputsSettings(inputs, ms * MILLISECOND)
        self.model = top.add(AnalogInputs("adc", chip, settings))
        simulator = self.simulator = Simulator(top)
        simulator.listen(self.model.voltages, lambda _at, value: self.voltages.append(value))
        simulator.listen(self.model.fault_out, lambda _at, value: self.faults.append(value))

    def run(self, until: int) -> None:
        assert self.simulator is not None
        self.simulator.run(until)

    def _now(self) -> int:
        return 0 if self.simulator is None else self.simulator.now


def test_every_input_is_read_once_a_period() -> None:
    rig = Rig()
    rig.run(SECOND)
    assert rig.faults == []
    assert rig.double.warnings == []
    assert rig.voltages[0].volts == pytest.approx((0.5, 1.0, 2.0), abs=1e-4)
    assert len(rig.voltages) == 17  # after 0.14 s of bring-up


def test_differences_are_read_with_their_sign() -> None:
    rig = Rig(("AIN2-AIN3", "AIN0-AIN1"))
    rig.volts[3] = 0.0
    rig.run(300 * MILLISECOND)
    assert rig.voltages[0].volts == pytest.approx((-0.25, -0.5), abs=1e-4)


def test_a_chip_that_lost_its_supply_is_brought_up_again_and_nothing_is_made_up() -> None:
    rig = Rig()
    rig.run(500 * MILLISECOND)
    seen = len(rig.voltages)
    rig.double.power_cycle()
    rig.volts[0] = 0.75
    rig.run(2 * SECOND)
    assert rig.faults != []
    assert all(each.volts[0] == pytest.approx(0.75, abs=1e-4) for each in rig.voltages[seen:])
    assert rig.model.unready() is None


@pytest.mark.parametrize(
    ("volts", "fault", "kind", "is_ready"),
    [
        pytest.param(
            1.0, NackAddress(address=0x48, times=None), "NoAcknowledge", False, id="silent"
        ),
        pytest.param(3.0, NackAddress(times=0), "NotReady", None, id="beyond the scale"),
    ],
)
def test_a_chip_that_gives_no_voltage_is_a_fault_and_no_reading(
    volts: float, fault: NackAddress, kind: str, *, is_ready: bool | None
) -> None:
    rig = Rig()
    rig.wire.faults = FaultScript([fault])
    rig.volts[1] = volts
    rig.run(SECOND)
    assert rig.voltages == []
    assert {fault.kind for fault in rig.faults} == {kind}
    assert is_ready is None or (rig.model.unready() is None) == is_ready


@pytest.mark.parametrize(("inputs", "ms"), [((), 50), (("AIN0",) * 4, 10), (("AIN7",), 50)])
def test_what_cannot_be_measured_in_time_is_refused(inputs: tuple[str, ...], ms: int) -> None:
    with pytest.raises(SettingError):
        Rig(inputs, ms)
