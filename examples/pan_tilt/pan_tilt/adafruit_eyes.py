"""The eyes by Adafruit's driver for the ADS1115, unmodified, over the robot's own bus.

It waits for each conversion, so four of them hold the loop for some 6 ms; what is our own does not.
"""

from typing import TYPE_CHECKING

from firmware_drivers.analog_inputs import Voltages
from firmware_drivers.circuitpython import Busio, CircuitPythonSensor, imports

from firmware_runtime.devs.time import seconds
from firmware_runtime.hal.i2c import I2cBus
from pan_tilt.settings import EyesTable

if TYPE_CHECKING:
    from adafruit_ads1x15 import AnalogIn

GAINS = {4.096: 1, 2.048: 2, 1.024: 4, 0.512: 8, 0.256: 16}
"""By full scale in V, as that driver counts them."""


def inputs_of(i2c: Busio, settings: EyesTable) -> "list[AnalogIn]":
    """The converter's four inputs, as that driver has them."""
    with imports():
        from adafruit_ads1x15 import ADS1115, AnalogIn  # noqa: PLC0415 -- an extra
    chip = ADS1115(
        i2c,
        gain=GAINS[settings.full_scale_v],
        data_rate=settings.rate_sps,
        address=settings.address,
    )
    return [AnalogIn(chip, number) for number in range(4)]


def adafruit_eyes(
    name: str, bus: I2cBus, settings: EyesTable
) -> "CircuitPythonSensor[list[AnalogIn], Voltages]":
    """A model that reads all four every period, and sends them at the port `voltages`."""
    return CircuitPythonSensor(
        name,
        bus,
        make=lambda i2c: inputs_of(i2c, settings),
        read=lambda inputs: Voltages(tuple(each.voltage for each in inputs)),
        kind=Voltages,
        period=seconds(settings.period_s),
        port="voltages",
    )
