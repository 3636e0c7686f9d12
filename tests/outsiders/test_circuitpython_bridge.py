"""Three of Adafruit's drivers, as published, in hardware models over our HAL, on doubles."""

from collections.abc import Callable
from typing import Any

import adafruit_ads1x15
import adafruit_motorkit
import adafruit_pca9685
import pytest
from firmware_drivers.chips.step import Step
from firmware_drivers.circuitpython import Busio, CircuitPythonSensor, driver_calls
from firmware_drivers.hardware import HardwareModel

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import HalError
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from tests.support.virtual_bus import VirtualBus


@pytest.fixture
def rig() -> VirtualBus:
    return VirtualBus()


class Throttle(HardwareModel):
    """Sets a driver to each value that arrives: what a user writes for an actuator."""

    def __init__(
        self, bus: I2cBus, make: Callable[[Busio], Any], put: Callable[[Any, float], None]
    ) -> None:
        super().__init__("throttle", lambda: [Step("driver made", self._make, 0)], bus)
        self.command = self.in_port("command", float)
        self._bus, self._driver_of, self._put = bus, make, put
        self._wanted: float | None = None

    def _make(self) -> None:
        with driver_calls(self._bus):
            self._driver = self._driver_of(Busio(self._bus))

    def begin(self) -> None:
        self.passivate("idle") if self._wanted is None else self.activate("writing")

    def external(self, elapsed: int) -> None:
        del elapsed
        self._wanted = self.command[-1]
        if self.phase == "idle":
            self.activate("writing")

    def proceed(self) -> None:
        assert self._wanted is not None
        try:
            with driver_calls(self._bus):
                self._put(self._driver, self._wanted)
        except HalError as error:
            self.note(error)
        self._wanted = None
        self.begin()


def test_a_light_sensor_on_an_ads1115_sends_volts(rig: VirtualBus) -> None:
    rig.connect(Ads1115Double, inputs=lambda at: (at / 1e9, 0.0, 0.0, 0.0))
    light = CircuitPythonSensor(
        "light",
        rig.bus,
        make=lambda i2c: adafruit_ads1x15.AnalogIn(adafruit_ads1x15.ADS1115(i2c), 0),
        read=lambda channel: float(channel.voltage),
        kind=float,
        period=100 * MILLISECOND,
    )
    received = rig.simulate([light], light.value)
    rig.run(1000 * MILLISECOND)
    assert len(received) > 8
    for at, volts in received:
        assert volts == pytest.approx(at / 1e9, abs=0.012)


def pwm_at_50_hz(i2c: Busio) -> Any:
    pwm = adafruit_pca9685.PCA9685(i2c)
    pwm.frequency = 50
    return pwm


def put_duty(pwm: Any, share: float) -> None:
    pwm.channels[0].duty_cycle = round(share * 0xFFFF)


def test_a_pca9685_is_set_up_in_the_time_of_its_bus_without_a_warning(rig: VirtualBus) -> None:
    chip = rig.connect(Pca9685Double)
    throttle = Throttle(rig.bus, pwm_at_50_hz, put_duty)
    rig.simulate([throttle])
    rig.run(0)
    assert rig.clock() > 5 * MILLISECOND
    assert chip.warnings == []
    assert chip.frequency_hz == pytest.approx(50.03, abs=0.01)


def test_a_command_reaches_the_motor_after_a_retry(rig: VirtualBus) -> None:
    chip = rig.connect(Pca9685Double, address=0x60)
    throttle = Throttle(
        rig.bus,
        lambda i2c: adafruit_motorkit.MotorKit(i2c=i2c).motor1,
        lambda motor, value: setattr(motor, "throttle", value),
    )
    rig.simulate([throttle])
    rig.run(0)
    rig.doubles.faults = FaultScript([NackAddress(times=1)])
    rig.send(throttle.command, 0.5, 20 * MILLISECOND)
    rig.run(30 * MILLISECOND)
    assert chip.duty(9) == pytest.approx(0.5, abs=1e-3)
    assert rig.bus.retries == 1
