"""The schematic: which chip hangs on which bus, and which wire leads where."""

from firmware_drivers.analog_inputs import AnalogInputs, AnalogInputsSettings, Voltages
from firmware_drivers.chips.ads1115 import Ads1115, Ads1115Settings
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.servo import Servo, Servos, ServosSettings

from firmware_runtime.board.robot import Lines
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import seconds
from pan_tilt.adafruit_eyes import adafruit_eyes
from pan_tilt.controller import Controller
from pan_tilt.settings import EyesTable, PanTiltSettings, ServosTable, ServoTable

INPUTS = ("AIN0", "AIN1", "AIN2", "AIN3")
"""Left, right, up, down."""


class PanTilt(Coupled):
    """eyes -> controller <-> servos.

    Chips are built here and not touched: the models bring them up, one step at a time.
    """

    def __init__(self, settings: PanTiltSettings, lines: Lines) -> None:
        super().__init__("pan_tilt")
        eyes, servos = settings.eyes, settings.servos
        bus = lines.buses[eyes.bus]
        self.adc_chip = Ads1115(bus, eyes.address, chip_settings(eyes))
        self.pwm_chip = Pca9685(lines.buses[servos.bus], servos.address, osc_hz=servos.osc_hz)

        self.voltages: OutPort[Voltages]
        """Of the eyes, by whichever driver."""
        if eyes.driver == "own":
            reading = AnalogInputsSettings(INPUTS, seconds(eyes.period_s))
            self.voltages = self.add(AnalogInputs("eyes", self.adc_chip, reading)).voltages
        else:
            self.voltages = self.add(adafruit_eyes("eyes", bus, eyes)).value
        self.controller = self.add(Controller("controller", settings))
        self.servos = self.add(
            Servos("servos", self.pwm_chip, servos_settings(servos), lines.interlock)
        )

        self.couple(self.voltages, self.controller.voltages)
        self.couple(self.controller.pan_angle, self.servos.angle["pan"])
        self.couple(self.controller.tilt_angle, self.servos.angle["tilt"])
        self.couple(self.servos.applied_out, self.controller.applied)


def chip_settings(eyes: EyesTable) -> Ads1115Settings:
    """The converter's settings."""
    return Ads1115Settings(full_scale_v=eyes.full_scale_v, rate_sps=eyes.rate_sps)


def servos_settings(servos: ServosTable) -> ServosSettings:
    """What the servos' model needs to know."""
    return ServosSettings(
        servos=(_servo("pan", servos.pan), _servo("tilt", servos.tilt)),
        frequency_hz=servos.frequency_hz,
        period=seconds(servos.period_s),
    )


def _servo(name: str, table: ServoTable) -> Servo:
    return Servo(
        name=name,
        channel=table.channel,
        least_rad=table.least_rad,
        most_rad=table.most_rad,
        least_pulse_us=table.least_pulse_us,
        most_pulse_us=table.most_pulse_us,
        slew_rad_s=table.slew_rad_s,
    )
