"""The schematic: which chip hangs on which bus, and which wire leads where."""

from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.dc_motor import DcMotor, DcMotorSettings
from firmware_drivers.gyro_bias import GyroBias
from firmware_drivers.imu import Imu
from firmware_drivers.output_state import OutputState

from balancing.controller import Controller
from balancing.settings import BalancingSettings, BridgeTable, WheelsTable
from balancing.sides import Sides
from firmware_runtime.board.robot import Lines
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import seconds
from firmware_runtime.models.motion import LeastApplied


class Balancing(Coupled):
    """imu, outputs -> controller -> sides -> left and right; `place` is where to stand, m.

    Chips are built here and not touched: the models bring them up, one step at a time.
    """

    def __init__(self, settings: BalancingSettings, lines: Lines) -> None:
        super().__init__("balancing")
        imu, wheels, period_s = settings.imu, settings.wheels, settings.controller.period_s
        self.imu_chip = Mpu9250(lines.buses[imu.bus], imu.address, chip_settings(settings))
        self.pwm_chip = Pca9685(lines.buses[wheels.bus], wheels.address, osc_hz=wheels.osc_hz)
        bias = GyroBias(max(2, round(imu.calibration_s / period_s)))

        def motor(name: str, bridge: BridgeTable) -> DcMotor:
            channel = HBridge(self.pwm_chip, bridge.pwm_channel, bridge.in1, bridge.in2)
            return DcMotor(name, channel, motor_settings(wheels), lines.interlock)

        self.imu = self.add(Imu("imu", self.imu_chip, seconds(period_s), bias))
        self.outputs = self.add(OutputState("outputs", lines.interlock))
        self.controller = self.add(Controller("controller", settings.controller))
        self.sides = self.add(Sides("sides", wheels.left.is_reversed, wheels.right.is_reversed))
        self.left = self.add(motor("left", wheels.left))
        self.right = self.add(motor("right", wheels.right))
        self.applied = self.add(LeastApplied("applied", ["left", "right"]))

        self.place = self.in_port("place", float)
        self.couple(self.place, self.controller.place)
        self.couple(self.imu.sample, self.controller.sample)
        self.couple(self.outputs.enabled, self.controller.enabled)
        self.couple(self.controller.drive, self.sides.drive)
        self.couple(self.sides.left, self.left.drive)
        self.couple(self.sides.right, self.right.drive)
        self.couple(self.left.applied_out, self.applied.applied["left"])
        self.couple(self.right.applied_out, self.applied.applied["right"])
        self.couple(self.applied.least, self.controller.applied)


def chip_settings(settings: BalancingSettings) -> Mpu9250Settings:
    """The IMU's registers as the board file wants them."""
    imu = settings.imu
    return Mpu9250Settings(
        sample_hz=imu.sample_hz, bandwidth_hz=imu.bandwidth_hz, mounting=imu.mounting
    )


def motor_settings(wheels: WheelsTable) -> DcMotorSettings:
    """What both motors need to know."""
    return DcMotorSettings(wheels.frequency_hz, seconds(wheels.timeout_s))
