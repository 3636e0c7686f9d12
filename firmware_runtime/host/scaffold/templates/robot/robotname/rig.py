"""The rig: the robot's chips as doubles on their bus, tied to its world."""

from collections.abc import Mapping

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.line_time import WireClock
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.models.motion import Motion
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.i2c_target import Target
from sim_doubles.rigs.buses import buses_of
from sim_doubles.rigs.enable import enable_line

from robotname.result import result
from robotname.settings import RobotNameSettings
from robotname.wiring import RobotName
from robotname.world import Probe, World


class RobotNameRig:
    """The doubles, each on the bus and at the address that board.toml gives it."""

    def __init__(self, settings: RobotNameSettings, clock: WireClock) -> None:
        motor, sonar = settings.motor, settings.sonar
        self._settings = settings
        self._now = clock
        self.pwm = Pca9685Double(clock, motor.address, true_osc_hz=motor.osc_hz)
        self.sonar = Srf08Double(clock, sonar.address, echoes=self._echoes)
        self.world = World(settings.world, self._drive)
        self.pwm.before_change = self.catch_up
        self.enable = enable_line(settings.output_enable, [self.pwm])
        wired: dict[str, list[Target]] = {name: [] for name in settings.buses}
        wired[motor.bus].append(self.pwm)
        wired[sonar.bus].append(self.sonar)
        self.buses = buses_of(settings.buses, wired, clock)
        self._probe = Probe(self.world, self.catch_up)

    @property
    def ports(self) -> Mapping[str, SerialPort]:
        """None: its chips are on I2C."""
        return {}

    @property
    def shown(self) -> OutPort[float]:
        """The distance from the wall."""
        return self._probe.distance_m

    def attach(self, robot: Coupled) -> None:
        """Add the world's probe; it looks whenever the sonar has."""
        assert isinstance(robot, RobotName)  # noqa: S101 -- a rig belongs to its board
        robot.add(self._probe)
        robot.couple(robot.sonar.distance_out, self._probe.tick)

    def catch_up(self) -> None:
        """Let the world go on, up to now."""
        self.world.advance(self._now())

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:  # noqa: ARG002
        """The true distance now, whatever the robot takes it for; what it was asked for, it says.

        An end of it that does not have the controller goes by the board file.
        """
        self.catch_up()
        asked_m = own.get("asked_m")
        if not isinstance(asked_m, float):
            asked_m = self._settings.controller.distance_m
        return result(asked_m, Motion(self.world.distance_m, -self.world.speed_m_s))

    @property
    def outputs(self) -> dict[str, int]:
        """How many outputs of the PCA9685 are on."""
        return {"motor": sum(duty > 0 for duty in self.pwm.duties)}

    def levels(self, at: int) -> dict[str, float]:  # noqa: ARG002 -- none changes by itself
        """The duty of each output."""
        return {f"motor.{channel}": duty for channel, duty in enumerate(self.pwm.duties)}

    def next_change_at(self, at: int) -> int:  # noqa: ARG002 -- at no instant
        """Never: a PCA9685 keeps its duties."""
        return NEVER

    def _drive(self) -> float:
        """What the bridge makes of its three inputs: a share of full voltage, -1 to 1."""
        motor, duty = self._settings.motor, self.pwm.duty
        return duty(motor.pwm_channel) * (duty(motor.in1) - duty(motor.in2))

    def _echoes(self, at: int) -> list[float]:
        """The one wall; the double drops what is out of its range."""
        self.world.advance(at)
        return [self.world.distance_m]
