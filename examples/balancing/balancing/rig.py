"""The rig: the robot's chips as doubles on their bus, tied to its world."""

from collections.abc import Mapping
from types import MappingProxyType

from balancing.probe import Probe
from balancing.result import STANDS_RAD, result
from balancing.settings import BalancingSettings, BridgeTable
from balancing.wiring import Balancing
from balancing.world import Drive, World
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.budget import WireClock
from firmware_runtime.models.motion import Motion
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.inertial_truth import ChipAxes, InertialTruth
from sim_doubles.rigs.board_rig import BoardRig

STANDS_BY = 5 * SECOND
"""Ns after which it stands, having been raised after one and a half seconds."""
STAYS_M = 0.1
"""It stays within 0.015 m for five minutes, and within 0.05 m where it is let go at 0.2 rad."""


class BalancingRig(BoardRig):
    """The doubles, each on the bus and at the address that board.toml gives it."""

    def __init__(self, settings: BalancingSettings, clock: WireClock) -> None:
        imu, wheels = settings.imu, settings.wheels
        super().__init__(settings.buses, clock, settings.output_enable)
        self._settings = settings
        self._axes = ChipAxes(imu.mounting)
        self.pwm = Pca9685Double(clock, wheels.address, true_osc_hz=wheels.osc_hz)
        self.world = World(settings.world, self._drives)
        self.pwm.before_change = self.catch_up
        magnetometer = Ak8963Double(clock, lambda at: self._truth(at).field)
        self.imu = Mpu9250Double(clock, self._truth, imu.address, magnetometer=magnetometer)
        self.connect(imu.bus, *self.imu.targets)
        self.connect(wheels.bus, self.pwm, name="wheels")
        self._probe = Probe(self.world, self.catch_up)

    push_unit = "rad/s of pitch"
    bears_push = 3.0
    said_within_s = 0.5
    """A gyro that is 0.5 rad/s off is contradicted by the speed that it leads to, 0.4 s later:
    sooner nothing that the robot has tells a wrong pitch from a right one."""
    off_within_s = MappingProxyType({"imu": 0.13, "controller.rolling_check": 0.13})
    """Its motors are off 0.1 s after the last sample (`wheels.timeout_s`), or where its gyro leads
    to a speed that it does not have."""
    bears_reading_of = ("imu", "wheels")
    held_within_s = 0.25
    healed_within_s = 2.0
    """An IMU that had no supply is up after a second, with its gyro's bias, and then the pitch is
    found anew."""
    borne = MappingProxyType({"balancing.world.pitch_rad": 0.3, "balancing.world.place_m": 1.0})
    """It swings half so far when it is pushed, and takes that up; and so far if its accelerometer
    lied as it was let go: its first pitch is what that says, and nothing else knows it. Its place
    it knows by its own drive alone, having no encoders: what a fault makes of that is not found."""

    @property
    def also_in(self) -> tuple[str, ...]:
        """Raised so far to the other side."""
        return (f"world.start_pitch_rad={-self._settings.world.start_pitch_rad}",)

    @property
    def shown(self) -> OutPort[float]:
        """The pitch."""
        return self._probe.pitch_rad

    def truth(self) -> dict[str, object]:
        """The true pitch and place, as the probe sends them."""
        self.catch_up()
        probe, world = self._probe, self.world
        return {probe.pitch_rad.path: world.pitch_rad, probe.place_m.path: world.place_m}

    def attach(self, robot: Coupled) -> None:
        """Add the world's probe, which looks with every sample."""
        assert isinstance(robot, Balancing)  # noqa: S101 -- a rig belongs to its board
        robot.add(self._probe)
        robot.couple(robot.imu.sample, self._probe.tick)

    def push(self, amount: float) -> None:
        """Change its pitch rate at once."""
        self.world.push(amount)

    def hold(self, *, is_held: bool) -> None:
        """Hold it in a hand, as it stands."""
        self.world.hold(is_held=is_held)

    def catch_up(self) -> None:
        """Let the sensor take what it still has to take, then the world go on, up to now."""
        super().catch_up()
        self.world.advance(self.now())

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:  # noqa: ARG002
        """The true pitch and place now, whatever the robot takes them for."""
        self.catch_up()
        world = self.world
        return result(Motion(world.pitch_rad, world.pitch_rate_rad_s), world.place_m)

    def lost(self) -> str | None:
        """It does not get up by itself."""
        return "it has fallen" if self.world.has_fallen else None

    def restore(self) -> None:
        """Raise it, as a hand does, where it began."""
        self.catch_up()
        self.world.put_back()

    def missed(self) -> str | None:
        """Return that it does not stand about where it was raised, once it has had time to."""
        world, at = self.world, self.now()
        if at < STANDS_BY:
            return None
        if abs(world.pitch_rad) > STANDS_RAD:
            return f"it leans by {world.pitch_rad:.2g} rad, {STANDS_RAD:g} at most"
        if abs(world.place_m) > STAYS_M:
            return f"it has rolled {world.place_m:.3g} m away, {STAYS_M:g} m at most"
        return None

    def _drives(self) -> tuple[Drive, Drive]:
        wheels = self._settings.wheels
        return self._drive(wheels.left), self._drive(wheels.right)

    def _drive(self, bridge: BridgeTable) -> Drive:
        """What the bridge makes of its three inputs."""
        pwm, in1, in2 = (
            self.pwm.duty(each) for each in (bridge.pwm_channel, bridge.in1, bridge.in2)
        )
        sign = -1.0 if bridge.is_reversed else 1.0
        return Drive(sign * pwm * (in1 - in2), is_connected=pwm > 0.0 and (in1 > 0.0 or in2 > 0.0))

    def _truth(self, at: int) -> InertialTruth:
        return self._axes.turn(self.world.inertial(at))
