"""The plant behind the doubles: a robot that drives to and fro before a wall.

The motor brings the robot to a speed in proportion to its drive, with a first-order lag. Nothing
runs in the background: `advance` brings the world to an instant, and is called before the drive
changes, so the motion between two calls is a formula and needs no small steps.
"""

import math
from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND

from robotname.settings import WorldTable


class World:
    """The robot at rest before the wall at instant 0; `drive` is its motor's, -1 to 1."""

    def __init__(self, settings: WorldTable, drive: Callable[[], float]) -> None:
        self.distance_m = settings.start_m
        self.speed_m_s = 0.0
        """Towards the wall."""
        self._settings = settings
        self._drive = drive
        self._at = 0

    def advance(self, at: int) -> None:
        """Bring the world to `at`, in ns, with the drive held since the last call."""
        elapsed_s, self._at = (at - self._at) / SECOND, at
        settled = self._drive() * self._settings.top_speed_m_s
        lag_s, gap = self._settings.lag_s, self.speed_m_s - settled
        left = math.exp(-elapsed_s / lag_s)
        self.distance_m -= settled * elapsed_s + gap * lag_s * (1.0 - left)
        self.speed_m_s = settled + gap * left
        if self.distance_m <= 0.0:
            self.distance_m = self.speed_m_s = 0.0


class Probe(Atomic):
    """Answers every `tick` with the true distance, so that a trace can carry it.

    waiting --tick?--> sending (0) --distance_m!--> waiting
    """

    def __init__(self, world: World, catch_up: Callable[[], None]) -> None:
        super().__init__("world")
        self.tick = self.in_port("tick", object)
        self.distance_m = self.out_port("distance_m", float)
        self._world = world
        self._catch_up = catch_up

    def output(self) -> None:
        """Send the distance, in m."""
        self.distance_m.send(self._world.distance_m)

    def internal(self) -> None:
        """Wait for the next tick."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- the world has its own clock
        """Bring the world to now."""
        self._catch_up()
        self.activate("sending")
