"""The arena's probe: puts the true state of things on ports, so that a trace can carry it."""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from sim_doubles.clock import Now
from sim_doubles.worlds.arena import Arena, Pose


class ArenaProbe(Atomic):
    """Answers every `tick` with where the vehicle is and how far from the target.

    waiting --tick?--> sending (0) --x_m!, y_m!, heading_rad!, distance_m!--> waiting

    `catch_up` is called before: sensors take what they have to before the arena goes on.
    """

    def __init__(self, arena: Arena, now: Now, catch_up: Callable[[], None]) -> None:
        super().__init__("world")
        self.tick = self.in_port("tick", object)
        self.x_m = self.out_port("x_m", float)
        self.y_m = self.out_port("y_m", float)
        self.heading_rad = self.out_port("heading_rad", float)
        self.distance_m = self.out_port("distance_m", float)
        self._arena = arena
        self._now = now
        self._catch_up = catch_up
        self._pose = Pose(0.0, 0.0, 0.0)
        self._distance_m = 0.0

    def output(self) -> None:
        """Send the state."""
        self.x_m.send(self._pose.x_m)
        self.y_m.send(self._pose.y_m)
        self.heading_rad.send(self._pose.heading_rad)
        self.distance_m.send(self._distance_m)

    def internal(self) -> None:
        """Wait for the next tick."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- the arena has its own clock
        """Read the arena's state now."""
        self._catch_up()
        now = self._now()
        self._pose = self._arena.pose(now)
        self._distance_m = self._arena.distance_to_target(now)
        self.activate("sending")
