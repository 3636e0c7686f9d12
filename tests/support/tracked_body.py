"""A body on a known course, an inertial unit and a tracking system with known noise, for tests."""

import cmath
import math
from dataclasses import dataclass
from random import Random

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.position_estimator import EstimatorSettings, PositionEstimator
from firmware_runtime.models.position_filter import FilterNoise
from firmware_runtime.models.position_fix import (
    FixReport,
    PlanarInertial,
    PositionFix,
    PositionState,
)
from tests.support.atomic_bench import AtomicBench

NOISE = FilterNoise(
    position_m=0.01,
    yaw_rad=0.01,
    acceleration=0.02,
    bias_walk=0.001,
    yaw_walk=0.0,
    first_velocity_m_s=0.2,
    first_bias_m_s2=0.1,
)
TICK = 10 * MILLISECOND


class Estimator:
    """A position estimator alone, fed from outside; what it sent is kept. Instants in ns."""

    def __init__(self, noise: FilterNoise = NOISE, *, history: int = 60, latency: int = 0) -> None:
        settings = EstimatorSettings(noise, 25.0, history, latency)
        self.model = PositionEstimator("estimator", settings)
        self._bench = AtomicBench(self.model)
        self.simulator = self._bench.simulator

    @property
    def reports(self) -> list[FixReport]:
        return self._bench.values("report")

    @property
    def x(self) -> list[Motion]:
        return self._bench.values("x")

    @property
    def y(self) -> list[Motion]:
        return self._bench.values("y")

    @property
    def yaw(self) -> list[Motion]:
        return self._bench.values("yaw")

    def put(self, at: int, **values: object) -> None:
        for name, value in values.items():
            self.simulator.inject(self.model.in_ports[name], value)
        self.simulator.advance(at)

    def sample(self, at: int, inertial: PlanarInertial = PlanarInertial(0, 0, 0, 0)) -> None:  # noqa: B008
        self.put(at, inertial=inertial)

    def state(self, at: int, state: PositionState) -> None:
        self.put(at, state=state)


@dataclass
class Body:
    """A body that turns evenly and is pushed about at random, and what its sensors say of it.

    Its accelerometer has a bias in its own axes. Between two ticks its acceleration is constant.
    """

    seed: int
    noise: FilterNoise = NOISE
    rate_rad_s: float = 0.3

    def __post_init__(self) -> None:
        self.random = random = Random(self.seed)  # noqa: S311 -- a test's
        first = self.noise.first_bias_m_s2
        self.bias = complex(random.gauss(0, first), random.gauss(0, first))
        speed = self.noise.first_velocity_m_s
        self.position, self.velocity = 0j, complex(random.gauss(0, speed), random.gauss(0, speed))
        self.at = 0

    def inertials(self) -> tuple[PlanarInertial, complex]:
        """The sample for the coming tick, and the true acceleration of it in the room's axes."""
        random, span_s = self.random, TICK / SECOND
        yaw = self.rate_rad_s * (self.at / SECOND + span_s / 2)
        push = complex(math.sin(1.3 * self.at / SECOND), math.cos(0.7 * self.at / SECOND)) * 0.2
        deviation = self.noise.acceleration / math.sqrt(span_s)
        shake = complex(random.gauss(0, deviation), random.gauss(0, deviation))
        said = push + self.bias + shake
        sample = PlanarInertial(said.real, said.imag, yaw, self.rate_rad_s)
        return sample, push * cmath.rect(1.0, yaw)

    def tick(self) -> PlanarInertial:
        """Move for a tick; give what the inertial unit says of it, as the mean over the tick."""
        sample, acceleration = self.inertials()
        span_s, walk = TICK / SECOND, self.noise.bias_walk * math.sqrt(TICK / SECOND)
        self.position += span_s * self.velocity + acceleration * span_s * span_s / 2
        self.velocity += span_s * acceleration
        self.bias += complex(self.random.gauss(0, walk), self.random.gauss(0, walk))
        self.at += TICK
        return sample

    def seen(self) -> PositionFix:
        """Its position now, as the tracking system sees it."""
        deviation = self.noise.position_m
        off = complex(self.random.gauss(0, deviation), self.random.gauss(0, deviation))
        place = self.position + off
        return PositionFix(place.real, place.imag, 0.0)
