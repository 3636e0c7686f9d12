"""Shows the world in a trace: the true pitch and place, at the robot's own instants."""

from collections.abc import Callable

from balancing.world import World
from firmware_runtime.devs.atomic import Atomic


class Probe(Atomic):
    """waiting --tick?--> showing (0) --pitch_rad! place_m!--> waiting."""

    def __init__(self, world: World, catch_up: Callable[[], None]) -> None:
        super().__init__("world")
        self.tick = self.in_port("tick", object)
        self.pitch_rad = self.out_port("pitch_rad", float)
        self.place_m = self.out_port("place_m", float)
        self._world = world
        self._catch_up = catch_up

    def output(self) -> None:
        """Send pitch, in rad, and place, in m."""
        self.pitch_rad.send(self._world.pitch_rad)
        self.place_m.send(self._world.place_m)

    def internal(self) -> None:
        """Wait for the next tick."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- the world has its own clock
        """Bring the world to now."""
        self._catch_up()
        self.activate("showing")
