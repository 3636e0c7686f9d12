"""TachoBot's rig: an MPU-9250 and one or two PCA9685, and the plant that ties them."""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Final

import msgspec
from firmware_boards.tachobot.controller import Controller
from firmware_boards.tachobot.result import SETTLED_RAD, SETTLED_RAD_S, yaw_result
from firmware_boards.tachobot.settings import TachobotSettings
from firmware_boards.tachobot.wiring import Tachobot

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.budget import WireClock
from firmware_runtime.models.motion import Motion
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.inertial_truth import BodyMotion, ChipAxes, Vector
from sim_doubles.rigs.board_rig import BoardRig
from sim_doubles.worlds.tachobot import (
    TachobotParameters,
    TachobotProbe,
    TachobotState,
    TachobotWorld,
)

if TYPE_CHECKING:
    from firmware_boards.tachobot.tracking import TrackingController

    from firmware_runtime.view.parts import Plane
    from sim_doubles.worlds.position_sensor import TruePose

_FASTEST_TURN_RAD_S: Final = 6.0
"""A turn a second: several times what any mission of this robot asks of it."""
_THERE_BY: Final = 8 * SECOND
_THERE_RAD: Final = 0.05
"""It takes 3.9 s to be there within 0.02 rad; friction may hold it a little aside."""


class TachobotRig(BoardRig):
    """The doubles, each at the address and with the oscillator that board.toml gives it."""

    def __init__(self, settings: TachobotSettings, clock: WireClock) -> None:
        thrust, imu = settings.thrust_pairs, settings.imu
        super().__init__(settings.buses, clock, settings.output_enable)
        self._settings, now = settings, self.now
        self._axes = ChipAxes(imu.mounting)
        self.thrust = Pca9685Double(now, thrust.address, true_osc_hz=thrust.osc_hz)
        self._all_duties: tuple[float, ...] = ()
        self._propellers: tuple[float, ...] = ()
        self.esc: Pca9685Double | None = None
        self.connect(thrust.bus, self.thrust, name="thrust_pairs")
        if (esc := settings.esc_in_use) is not None:
            self.esc = Pca9685Double(now, esc.address, true_osc_hz=esc.osc_hz)
            self.connect(esc.bus, self.esc, name="esc")
        self.world = TachobotWorld(_parameters(settings), self._propeller_duties)
        self.thrust.before_change = self.catch_up
        field, motion = self._felt()
        self.magnetometer = Ak8963Double(now, field, noise_seed=None)
        self.imu = Mpu9250Double(  # the world has its noise
            now, motion, imu.address, magnetometer=self.magnetometer, noise_seed=None
        )
        self._probe = TachobotProbe(self._observe)
        self._controller: Controller | None = None
        self._settled_at: int | None = None
        """Since when the yaw has been where it should be, as far as the probe has seen."""
        self._tracked: TrackingController | None = None
        self.connect(imu.bus, *self.imu.targets)

    push_unit = "rad/s of yaw"
    bears_push = 1.0
    bears_reading_of = ("imu", "thrust_pairs")
    off_within_s: ClassVar[Mapping[str, float]] = MappingProxyType(
        {"imu": 0.06, "controller.movement_check": 0.1}
    )
    """Thrust is off 0.05 s after the last sample (`thrust_pairs.timeout_s`), or where it does not
    turn as it is driven."""
    ends_within_s: ClassVar[Mapping[str, float]] = MappingProxyType(
        {"controller.heading_check": 1.1}
    )
    """A gyro that lies is reported twice a second, and thrust is off until it does not."""

    @property
    def held_within_s(self) -> float:
        """It follows each sample, whose noise alone changes it within 0.1 s.

        Where it hovers its lift never changes, and is at no end of its range, so that pairs at
        theirs count: as long as it takes to stop a turn.
        """
        return 0.25 if self._settings.esc_in_use is None else 1.5

    @property
    def also_in(self) -> tuple[str, ...]:
        """The other way round, on its platform."""
        control = self._settings.controller
        if control.mode != "platform":
            return ()
        return (f"controller.yaw.reference_rad={-control.yaw.reference_rad}",)

    @property
    def borne(self) -> Mapping[str, float]:
        """In m, m/s, rad and rad/s: what a gyro turns it whose compass does not contradict it yet.

        Half a radian of that is believed (`heading_check`), as a bias within its data sheet makes
        a third of it. Where it hovers, also what one propeller of eight pushes it aside: nothing
        else pushes there, not even friction, and the others hold it. What turns it further its
        movement contradicts; nothing on board measures where it is.
        """
        turns = {self._probe.yaw_rad.path: 0.4}
        if self._settings.esc_in_use is None:
            return turns
        moves = {f"tachobot.world.{axis}.{part}": 0.2 for axis in "xy" for part in (0, 1)}
        return {**moves, **turns, self._probe.yaw_rate_rad_s.path: 0.35}

    @property
    def healed_within_s(self) -> float:
        """2.2 s, and where it hovers what its speed controller takes to be armed again, too.

        A PCA9685 that was reset is found so once a second (`POLL_EVERY`), and by its movement just
        before that where it braked, which then rests for another second (`movement_check.again_s`);
        an IMU that answers again is up after 0.4 s, and 0.9 s at the start, with the gyro's bias.
        """
        esc = self._settings.esc_in_use
        return 2.2 + (0.0 if esc is None else esc.arming_s)

    @property
    def recovered_within_s(self) -> float:
        """5 s; where it hovers nothing brakes it, and it turns on while it is off.

        That is while it is disarmed for 3 s, and while its speed controller is armed again; it
        takes as long to turn back.
        """
        esc = self._settings.esc_in_use
        return 5.0 + (0.0 if esc is None else 2 * esc.arming_s)

    @property
    def is_driven(self) -> bool:
        """Whether the pairs push: the lift alone moves it nowhere."""
        return self.outputs["thrust_pairs"] > 0

    @property
    def shown(self) -> OutPort[float]:
        """The yaw."""
        return self._probe.yaw_rad

    @property
    def plane(self) -> "Plane":
        """Return the robot from above."""
        from sim_doubles.worlds.tachobot_plane import tachobot_plane  # noqa: PLC0415 -- for pages

        parameters = _parameters(self._settings)
        return tachobot_plane(parameters.lever_arm_m, parameters.mounting)

    def truth(self) -> dict[str, object]:
        """The true yaw and place, as the probe sends them, but that whole turns do not count."""
        self.catch_up()
        x, vx, y, vy, yaw, rate = self.world.state(self.now())
        return {
            self._probe.yaw_rad.path: math.remainder(yaw, math.tau),
            self._probe.yaw_rate_rad_s.path: rate,
            self._probe.x.path: Motion(x, vx),
            self._probe.y.path: Motion(y, vy),
        }

    def judge(self) -> str | None:
        """Return that the robot turns faster than any of its missions lets it, in a campaign."""
        rate = self.world.state(self.now())[5]
        if abs(rate) <= _FASTEST_TURN_RAD_S:
            return None
        return f"it turns at {rate:.3g} rad/s, {_FASTEST_TURN_RAD_S:g} at most"

    def missed(self) -> str | None:
        """Return that the yaw is not where the board file wants it, once there was time for it.

        On the platform, in closed loop.
        """
        control, at = self._settings.controller, self.now()
        if at < _THERE_BY or control.mode != "platform" or control.yaw.wave is not None:
            return None
        reference_rad, yaw_rad = control.yaw.reference_rad, self.world.state(at).yaw_rad
        if abs(math.remainder(yaw_rad - reference_rad, math.tau)) <= _THERE_RAD:
            return None
        return f"its yaw is {yaw_rad:.3g} rad after {at / SECOND:.3g} s, not {reference_rad:.3g}"

    def attach(self, robot: Coupled) -> None:
        """Add the world's probe, and the room's tracking system: in mode `free` that is ideal."""
        assert isinstance(robot, Tachobot)  # noqa: S101 -- a rig belongs to its board
        probe = robot.add(self._probe)
        robot.couple(robot.imu.sample, probe.tick)
        if not isinstance(robot.controller, Controller):
            self._tracked = robot.controller
            self._attach_position_sensor(robot)
            return
        self._controller = robot.controller
        if self._settings.controller.mode == "free":
            robot.couple(probe.x, robot.controller.x_position)
            robot.couple(probe.y, robot.controller.y_position)

    def _attach_position_sensor(self, robot: Tachobot) -> None:
        table = self._settings.world.position
        if not table.rate_hz:
            return
        from sim_doubles.worlds.position_sensor import PositionSensor  # noqa: PLC0415 -- mode track

        sensor = robot.add(PositionSensor(table, self._pose, self.now))
        if table.yaw:
            robot.couple(sensor.pose, robot.position_input.pose_in)
        else:
            robot.couple(sensor.position, robot.position_input.position_in)

    def _pose(self) -> "TruePose":
        from sim_doubles.worlds.position_sensor import TruePose  # noqa: PLC0415 -- mode track

        self.catch_up()
        state = self.world.state(self.now())
        return TruePose(state.x_m, state.y_m, state.yaw_rad)

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:  # noqa: ARG002
        """The true yaw, or pose, however long the run took and whatever the robot takes it for.

        `settled_after_s` is when the probe found the yaw settled, if it has been since then; None
        also where the controller, with the reference, runs elsewhere.
        Whether control has begun is the robot's word: without a yaw it has not. So is its reference
        at the end; an end of a cut robot that does not have the controller goes by the board file.
        """
        if self._tracked is not None:
            from firmware_boards.tachobot.track_result import track_result  # noqa: PLC0415 -- mode track

            from firmware_runtime.models.trajectory_paths import Pose  # noqa: PLC0415 -- likewise

            return track_result(self._tracked, Pose(*self._pose()))
        self.catch_up()
        state = self.world.state(self.now())
        yaw = Motion(state.yaw_rad, state.yaw_rate_rad_s)
        settled_at, reference_rad = self._settled_at, own.get("yaw_reference_rad")
        if not isinstance(reference_rad, float):
            settled_at, reference_rad = None, self._settings.controller.yaw.reference_rad
        result = yaw_result(reference_rad, yaw, has_begun=own.get("yaw_rad", ...) is not None)
        if settled_at is None or not result["settled"]:
            return {**result, "settled_after_s": None}
        return {**result, "settled_after_s": settled_at / SECOND}

    def _observe(self) -> TachobotState:
        """The plant's state now, noted where it settles."""
        self.catch_up()
        at = self.now()
        state = self.world.state(at)
        if self._controller is not None:
            error = math.remainder(self._controller.yaw.reference - state.yaw_rad, math.tau)
            if not (abs(error) <= SETTLED_RAD and abs(state.yaw_rate_rad_s) <= SETTLED_RAD_S):
                self._settled_at = None
            elif self._settled_at is None:
                self._settled_at = at
        return state

    def _propeller_duties(self) -> tuple[float, ...]:
        duties = self.thrust.duties
        if duties is not self._all_duties:
            first = self._settings.thrust_pairs.first_channel
            self._all_duties, self._propellers = duties, duties[first : first + 8]
        return self._propellers

    def push(self, amount: float) -> None:
        """Change its yaw rate at once."""
        self.world.push(amount)

    def hold(self, *, is_held: bool) -> None:
        """Keep it where it is, at rest."""
        self.world.hold(is_held=is_held)

    def catch_up(self) -> None:
        """Let the sensor take what it still has to take, then the plant go on, up to now."""
        self.imu.catch_up()
        self.world.advance(self.now())

    def _felt(self) -> tuple[Callable[[int], Vector], Callable[[int], BodyMotion]]:
        """Field and motion in the chip's axes; the world's own where those are the body's."""
        if self._axes.is_identity:
            return self.world.field, self.world.motion
        return self._field, self._motion

    def _motion(self, at: int) -> BodyMotion:
        return self._axes.turn_motion(self.world.motion(at))

    def _field(self, at: int) -> Vector:
        return self._axes.turn_vector(self.world.field(at))


def _parameters(settings: TachobotSettings) -> TachobotParameters:
    """The plant as board.toml describes it."""
    is_held = settings.controller.mode == "platform"
    world = msgspec.structs.asdict(settings.world)
    return TachobotParameters(**world, mounting="platform" if is_held else "free")
