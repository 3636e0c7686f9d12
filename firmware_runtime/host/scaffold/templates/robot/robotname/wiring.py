"""The schematic: which chip hangs on which bus, and which wire leads where."""

from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings
from firmware_drivers.dc_motor import DcMotor, DcMotorSettings
from firmware_drivers.sonar import Sonar, SonarSettings

from firmware_runtime.board.lines import Lines
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import seconds

from robotname.controller import Controller
from robotname.settings import RobotNameSettings


class RobotName(Coupled):
    """sonar -> controller <-> motor; `distance_m` asks for another distance while it runs.

    Chips are built here and not touched: the models bring them up, one step at a time.
    """

    def __init__(self, settings: RobotNameSettings, lines: Lines) -> None:
        super().__init__("robotname")
        motor, sonar = settings.motor, settings.sonar
        self.pwm_chip = Pca9685(lines.buses[motor.bus], motor.address, osc_hz=motor.osc_hz)
        bridge = HBridge(self.pwm_chip, motor.pwm_channel, motor.in1, motor.in2)
        ranging = Srf08Settings(max_range_m=sonar.max_range_m)
        self.sonar_chip = Srf08(lines.buses[sonar.bus], sonar.address, ranging)

        self.distance_m = self.in_port("distance_m", float)
        # An echo from anywhere within range counts as a wall.
        pings = SonarSettings(seconds(sonar.period_s), threshold_m=sonar.max_range_m)
        driving = DcMotorSettings(motor.frequency_hz, seconds(motor.timeout_s))
        self.sonar = self.add(Sonar("sonar", self.sonar_chip, pings))
        self.controller = self.add(Controller("controller", settings.controller))
        self.motor = self.add(DcMotor("motor", bridge, driving, lines.interlock))

        self.couple(self.controller.sonar, self.sonar.start)
        self.couple(self.sonar.distance_out, self.controller.distance)
        self.couple(self.sonar.detected_out, self.controller.wall)
        self.couple(self.distance_m, self.controller.reference)
        self.couple(self.controller.drive, self.motor.drive)
        self.couple(self.motor.applied_out, self.controller.applied)
