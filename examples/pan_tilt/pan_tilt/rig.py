"""The rig: the head's chips as doubles on their bus, tied to servos, photocells and a light."""

from collections.abc import Mapping

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.line_time import WireClock
from firmware_runtime.hal.serial import SerialPort
from pan_tilt.settings import PanTiltSettings, ServoTable
from pan_tilt.wiring import PanTilt
from pan_tilt.world import Light, Probe
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.i2c_target import Target
from sim_doubles.rigs.buses import buses_of
from sim_doubles.rigs.enable import enable_line
from sim_doubles.worlds.servo import ServoParameters, ServoPlant, pulse_of

ON_TARGET_RAD = 0.1


class PanTiltRig:
    """The doubles, each on the bus and at the address that board.toml gives it."""

    def __init__(self, settings: PanTiltSettings, clock: WireClock) -> None:
        eyes, servos = settings.eyes, settings.servos
        self._now = clock
        self.pwm = Pca9685Double(clock, servos.address, true_osc_hz=servos.osc_hz)
        self.pan, self.tilt = self._servo(servos.pan), self._servo(servos.tilt)
        self.light = Light(settings.world)
        self.adc = Ads1115Double(clock, eyes.address, inputs=self._voltages)
        self.pwm.before_change = self.catch_up
        self.enable = enable_line(settings.output_enable, [self.pwm])
        wired: dict[str, list[Target]] = {name: [] for name in settings.buses}
        wired[eyes.bus].append(self.adc)
        wired[servos.bus].append(self.pwm)
        self.buses = buses_of(settings.buses, wired, clock)
        self._probe = Probe(lambda: (self._error_rad(), self.pan.angle_rad(self._now())))

    @property
    def ports(self) -> Mapping[str, SerialPort]:
        """None: its chips are on I2C."""
        return {}

    @property
    def shown(self) -> OutPort[float]:
        """How far beside the light the head looks."""
        return self._probe.error_rad

    def attach(self, robot: Coupled) -> None:
        """Add the world's probe, which looks with every reading."""
        assert isinstance(robot, PanTilt)  # noqa: S101 -- a rig belongs to its board
        robot.add(self._probe)
        robot.couple(robot.voltages, self._probe.tick)

    def catch_up(self) -> None:
        """Let the converter take what it still has to take, then the servos turn, up to now."""
        self.adc.catch_up()
        for servo in (self.pan, self.tilt):
            servo.advance(self._now())

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:  # noqa: ARG002
        """How far beside the light the head looks, and whether it is on target."""
        self.catch_up()
        error_rad = self._error_rad()
        shines = self.light.shines(self._now())
        return {**own, "error_rad": error_rad, "on_target": shines and error_rad <= ON_TARGET_RAD}

    @property
    def outputs(self) -> dict[str, int]:
        """How many outputs of the PCA9685 are on."""
        return {"servos": sum(duty > 0 for duty in self.pwm.duties)}

    def levels(self, at: int) -> dict[str, float]:  # noqa: ARG002 -- none changes by itself
        """The duty of each output."""
        return {f"servos.{channel}": duty for channel, duty in enumerate(self.pwm.duties)}

    def next_change_at(self, at: int) -> int:  # noqa: ARG002 -- at no instant
        """Never: a PCA9685 keeps its duties."""
        return NEVER

    def _servo(self, table: ServoTable) -> ServoPlant:
        given = ServoParameters(
            least_rad=table.least_rad,
            most_rad=table.most_rad,
            least_pulse_us=table.least_pulse_us,
            most_pulse_us=table.most_pulse_us,
        )
        return ServoPlant(given, pulse_of(self.pwm, table.channel))

    def _voltages(self, at: int) -> list[float]:
        return self.light.voltages(at, self.pan.angle_rad(at), self.tilt.angle_rad(at))

    def _error_rad(self) -> float:
        at = self._now()
        return self.light.error(at, self.pan.angle_rad(at), self.tilt.angle_rad(at))
