"""The plant behind the doubles: an inverted pendulum on two wheels that turn as one.

A body of mass m, its centre of mass l above the axle, and wheels of radius r, without slip. With
pitch t (forward positive), place x and the torque T of both motors on the wheels:

    (M + m) x'' + m l cos(t) t'' = T / r + m l t'^2 sin(t)
    m l cos(t) x'' + (I + m l^2) t'' = m g l sin(t) - T

A motor gives its stall torque at full voltage and rest, and falls linearly to nothing at its
no-load speed; with no voltage at all it runs free, short-circuited it brakes. The robot is held by
hand for a while, and until the motors were felt to push. Beyond a right angle less a little it lies
on the floor.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from balancing.settings import WorldTable
from firmware_runtime.devs.time import NEVER, SECOND, seconds
from sim_doubles.inertial_truth import InertialTruth

GRAVITY = 9.80665
STEP_S = 0.001
FEELS = SECOND // 100
"""Ns for which the motors push before the hand lets go."""
RAISED_IN = SECOND
"""Ns that a hand takes to raise it."""
FLOOR_RAD = 1.3
"""Pitch at which the body touches the floor."""
FIELD_T = (20e-6, 0.0, -40e-6)


class Drive(NamedTuple):
    """What a bridge does to a motor: a share of full voltage, and whether it is connected."""

    voltage: float
    is_connected: bool


class World:
    """The robot at its start; `drives` are both motors' at the moment."""

    def __init__(self, settings: WorldTable, drives: Callable[[], tuple[Drive, Drive]]) -> None:
        self.settings = settings
        self.pitch_rad = settings.start_pitch_rad
        self.pitch_rate_rad_s = 0.0
        self.place_m = 0.0
        self.speed_m_s = 0.0
        self._acceleration = (0.0, 0.0)
        self._drives = drives
        self._held = seconds(settings.held_s)
        self._released_at = NEVER
        self._at = 0
        self._is_held = False
        self._raised_by = 0

    @property
    def has_fallen(self) -> bool:
        """Whether it lies on the floor."""
        return abs(self.pitch_rad) >= FLOOR_RAD

    def advance(self, at: int) -> None:
        """Bring the world to `at`, in ns, with the drives held since the last call."""
        drives = self._drives()
        if self._released_at == NEVER and any(drive.is_connected for drive in drives):
            self._released_at = max(self._held, self._at + FEELS)
        since = max(self._at, min(self._released_at, at))
        self._rise(min(since, self._raised_by))
        self._at = max(at, self._at)
        left_s = (self._at - since) / SECOND
        while left_s > 0.0 and not self.has_fallen and not self._is_held:
            step_s = min(STEP_S, left_s)
            self._step(step_s, drives)
            left_s -= step_s

    def inertial(self, at: int) -> InertialTruth:
        """What the sensor on the axle feels: body axes, x forward, z up; m/s2, rad/s, T."""
        self.advance(at)
        along, _ = self._acceleration
        sine, cosine = math.sin(self.pitch_rad), math.cos(self.pitch_rad)
        force = (along * cosine - GRAVITY * sine, 0.0, along * sine + GRAVITY * cosine)
        return InertialTruth(force, (0.0, self.pitch_rate_rad_s, 0.0), FIELD_T, 25.0)

    def push(self, speed_rad_s: float) -> None:
        """Give the body a push: its pitch rate changes at once, in rad/s."""
        self.pitch_rate_rad_s += speed_rad_s

    def hold(self, *, is_held: bool) -> None:
        """Hold it as it stands, at rest, or let go of it."""
        self.speed_m_s = self.pitch_rate_rad_s = 0.0
        self._acceleration = (0.0, 0.0)
        self._is_held = is_held

    def put_back(self) -> None:
        """Raise it in RAISED_IN where it began, and hold it until a motor pushes."""
        self.hold(is_held=False)
        self.place_m = 0.0
        to_start_rad = self.settings.start_pitch_rad - self.pitch_rad
        self.pitch_rate_rad_s = to_start_rad * SECOND / RAISED_IN
        self._held, self._released_at = self._at, NEVER
        self._raised_by = self._at + RAISED_IN

    def _rise(self, until: int) -> None:
        """Turn it as the hand does that raises it, until it is there or let go of."""
        if until <= self._at:
            return
        self.pitch_rad += self.pitch_rate_rad_s * (until - self._at) / SECOND
        if until == self._raised_by:
            self.pitch_rate_rad_s = 0.0

    def _step(self, step_s: float, drives: tuple[Drive, Drive]) -> None:
        """One step of semi-implicit Euler: rates first, then what they lead to."""
        along, turning = self._acceleration = self._accelerations(drives)
        self.speed_m_s += along * step_s
        self.pitch_rate_rad_s += turning * step_s
        self.place_m += self.speed_m_s * step_s
        self.pitch_rad += self.pitch_rate_rad_s * step_s
        if self.has_fallen:
            self.pitch_rad = math.copysign(FLOOR_RAD, self.pitch_rad)
            self.speed_m_s = self.pitch_rate_rad_s = 0.0
            self._acceleration = (0.0, 0.0)

    def _accelerations(self, drives: tuple[Drive, Drive]) -> tuple[float, float]:
        """Of the place in m/s2 and of the pitch in rad/s2: two equations in two unknowns."""
        body = self.settings
        torque = sum(map(self._torque, drives))
        sine, cosine = math.sin(self.pitch_rad), math.cos(self.pitch_rad)
        moment = body.body_mass_kg * body.centre_height_m
        mass = body.wheel_mass_kg + body.body_mass_kg
        inertia = body.body_inertia_kg_m2 + moment * body.centre_height_m
        coupling = moment * cosine
        force = torque / body.wheel_radius_m + moment * self.pitch_rate_rad_s**2 * sine
        turning = moment * GRAVITY * sine - torque
        determinant = mass * inertia - coupling * coupling
        return (
            (force * inertia - coupling * turning) / determinant,
            (mass * turning - coupling * force) / determinant,
        )

    def _torque(self, drive: Drive) -> float:
        """Of one motor on its wheel, N m; the wheel turns against the body."""
        if not drive.is_connected:
            return 0.0
        body = self.settings
        speed = self.speed_m_s / body.wheel_radius_m - self.pitch_rate_rad_s
        return body.stall_torque_nm * (drive.voltage - speed / body.no_load_rad_s)
