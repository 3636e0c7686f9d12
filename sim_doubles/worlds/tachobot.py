"""TachoBot's plant: a rigid body in the plane, turned and pushed by eight propellers.

The model is equation (1) of Pecker Marcosig, Giribet and Castro, "DEVS-over-ROS", Winter Simulation
Conference 2018: four forces from four pairs of propellers (`propellers`) on a body with three
degrees of freedom. Standing on its rotating platform (`turntable`) it only turns, against the
bearing's friction; hovering on its central propeller (`hovering`) it moves freely.

Nothing runs in the background. `advance` brings the plant to an instant: the sensors' double calls
it before it samples, and the PWM double before its outputs change, so that between two
calls the duties are constant. Over such a stretch yaw is a formula, and x and y an integral of one,
so how often it is read does not matter.

Not modelled: tilt and lift, the reaction torque of the propellers, ripple of the PWM, a battery
that sags, an IMU mounted off centre.

The probe puts the true state of the plant on ports, so that a trace can carry it.
"""

import math
from collections.abc import Callable, Sequence
from typing import Protocol

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND, format_time
from firmware_runtime.models.motion import Motion
from sim_doubles.inertial_truth import BodyMotion, InertialTruth, Vector
from sim_doubles.worlds.noise import InstantNoise
from sim_doubles.worlds.propellers import MOTORS, PropellerPairs
from sim_doubles.worlds.tachobot_body import (
    Hovering,
    Mounting,
    TachobotParameters,
    TachobotState,
    Turntable,
)

__all__ = ["Mounting", "TachobotParameters", "TachobotState", "TachobotWorld"]

_GRAVITY_M_S2 = 9.80665
_FIELD_NORTH_T = 20e-6
_FIELD_UP_T = -40e-6
_TEMPERATURE_C = 25.0


class TachobotWorld:
    """The plant behind TachoBot's doubles, at rest at instant 0.

    `duties` returns what the eight motors get now, 0 to 1 each; pair i has the motors 2i and
    2i + 1. `advance` must be called before they change. Instants are ns and never go back.
    """

    def __init__(
        self, parameters: TachobotParameters, duties: Callable[[], Sequence[float]]
    ) -> None:
        self._duties = duties
        self._propellers = PropellerPairs(parameters.pair_thrust_n, parameters.motor_lag_s)
        self._body = _body_of(parameters)
        self._gyro_bias = parameters.gyro_bias_rad_s
        self._gyro_noise = InstantNoise("gyro", parameters.seed, parameters.gyro_noise_rad_s)
        self._field_noise = InstantNoise("field", parameters.seed, parameters.field_noise_t)
        self._bias = parameters.accelerometer_bias_m_s2
        self._shake = InstantNoise(
            "accelerometer", parameters.seed, parameters.accelerometer_noise_m_s2
        )
        self._shakes = parameters.accelerometer_noise_m_s2 > 0.0
        self._sound_duties: Sequence[float] = ()
        self._at = 0

    def advance(self, at: int) -> None:
        """Bring the plant to `at` with the duties held since the last call; free if it is there.

        Raises ValueError if `at` is in the past or a duty is not a number from 0 to 1.
        """
        elapsed = at - self._at
        if elapsed == 0:
            return
        if elapsed < 0:
            raise ValueError(
                f"TachoBot world: advance to {format_time(at)} when it is "
                f"{format_time(self._at)} there; expected an instant not in the past"
            )
        ask = self._duties  # as a local, which CPython calls sooner
        duties = ask()
        if duties is not self._sound_duties:
            self._drive(duties)
        self._body.advance(self._propellers, elapsed / SECOND)
        self._at = at

    def state(self, at: int) -> TachobotState:
        """Return the body's pose at `at`, which is advanced to."""
        self.advance(at)
        return self._body.state

    def push(self, rate_rad_s: float) -> None:
        """Give the body a push where it is: its yaw rate changes by so much at once."""
        self._body.push(rate_rad_s)

    def hold(self, *, is_held: bool) -> None:
        """Keep the body where it is, at rest, or let go of it; its propellers turn as driven."""
        self._body.hold(is_held=is_held)

    def inertial(self, at: int) -> InertialTruth:
        """Return the truth for an IMU with a magnetometer in the centre: `motion` and `field`."""
        felt = self.motion(at)
        return InertialTruth(felt.acceleration, felt.rate, self.field(at), felt.temperature_c)

    def motion(self, at: int) -> BodyMotion:
        """Return the truth for accelerometer and gyroscope in the centre at `at`, advanced to.

        Body axes: x forward, y left, z up. Acceleration in m/s2 is the specific force, +9.80665 up
        at rest; both it and rate in rad/s have their sensor's bias and noise; 25 degC. Noise
        depends on seed and instant only.
        """
        self.advance(at)
        forward, left = self._body.acceleration(self._driven)
        shake_x, shake_y, shake_z = self._shake.at(at) if self._shakes else (0.0, 0.0, 0.0)
        noise_x, noise_y, noise_z = self._gyro_noise.at(at)
        return BodyMotion(
            (
                forward + self._bias + shake_x,
                left + self._bias + shake_y,
                _GRAVITY_M_S2 + shake_z,
            ),
            (noise_x, noise_y, self._body.turn[1] + self._gyro_bias + noise_z),
            _TEMPERATURE_C,
        )

    def field(self, at: int) -> Vector:
        """The magnetic field at `at`, which is advanced to, in T and body axes.

        20 uT north and 40 uT down with noise, north being forward at yaw 0.
        """
        self.advance(at)
        yaw = self._body.turn[0]
        field_x, field_y, field_z = self._field_noise.at(at)
        return (
            _FIELD_NORTH_T * math.cos(yaw) + field_x,
            -_FIELD_NORTH_T * math.sin(yaw) + field_y,
            _FIELD_UP_T + field_z,
        )

    def _driven(self) -> PropellerPairs:
        """The propellers with the duties that they get now."""
        self._drive(self._duties())
        return self._propellers

    def _drive(self, duties: Sequence[float]) -> None:
        """Have the propellers take these duties; kept as a tuple, so that it is known again."""
        if duties != self._sound_duties:
            if len(duties) != MOTORS or [duty for duty in duties if not 0.0 <= duty <= 1.0]:
                raise ValueError(f"TachoBot world: duties are {duties}, expected eight from 0 to 1")
            self._sound_duties = tuple(duties)
            self._propellers.hold(self._sound_duties)


class Body(Protocol):
    """Motion of TachoBot under its propellers, at rest at first."""

    @property
    def turn(self) -> tuple[float, float]:
        """Yaw and its rate."""

    @property
    def state(self) -> TachobotState:
        """Return its state now."""

    def acceleration(self, driven: Callable[[], PropellerPairs], /) -> tuple[float, float]:
        """Forward and left, in m/s2, now."""

    def push(self, rate_rad_s: float) -> None:
        """Change the yaw rate by so much, at once."""

    def hold(self, *, is_held: bool) -> None:
        """Keep it where it is, at rest, or let go of it."""

    def advance(self, propellers: PropellerPairs, elapsed_s: float) -> None:
        """Move for `elapsed_s` as these push, whose duties hold; for them it has passed then."""


def _body_of(parameters: TachobotParameters) -> Body:
    """The body by its mounting, and by the way in which its motion is worked out."""
    if parameters.solver != "exact":
        from sim_doubles.worlds.quantized import (  # noqa: PLC0415 -- few runs load its blocks
            QuantizedBody,
        )

        return QuantizedBody(parameters, parameters.solver)
    return Hovering(parameters) if parameters.mounting == "free" else Turntable(parameters)


class TachobotProbe(Atomic):
    """Answers every `tick` with the plant's state at that instant, which `observe` takes.

    waiting --tick?--> sending (0) --yaw_rad!, yaw_rate_rad_s!, x!, y!--> waiting

    `observe` first lets sensors take what they have to, and then the plant go on.
    `x` and `y` are what a tracking system in the room would measure; nothing on board can. They are
    made where there is a listener, and in every recorded run: 1 us and 34 bytes a control tick, for
    the truth that `export` and `debug` show later. On the robot itself there is no world.
    """

    def __init__(self, observe: Callable[[], TachobotState]) -> None:
        super().__init__("world")
        self.tick = self.in_port("tick", object)
        self.yaw_rad = self.out_port("yaw_rad", float)
        self.yaw_rate_rad_s = self.out_port("yaw_rate_rad_s", float)
        self.x = self.out_port("x", Motion)
        self.y = self.out_port("y", Motion)
        self._observe = observe
        self._state: TachobotState | None = None

    def output(self) -> None:
        """Send the state."""
        if self._state is not None:
            x, vx, y, vy, yaw, rate = self._state
            self.yaw_rad.send(yaw)
            self.yaw_rate_rad_s.send(rate)
            if self.x.leads_somewhere or self.y.leads_somewhere:
                self.x.send(Motion(x, vx))
                self.y.send(Motion(y, vy))

    def internal(self) -> None:
        """Wait for the next tick."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- the world has its own clock
        """Read the plant's state now."""
        self._state = self._observe()
        self.activate("sending")
