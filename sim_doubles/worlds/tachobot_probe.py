"""The world's probe: puts the plant's true state on ports, so that a trace can carry it."""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.models.motion import Motion
from sim_doubles.clock import Now
from sim_doubles.worlds.tachobot import TachobotState, TachobotWorld


class TachobotProbe(Atomic):
    """Answers every `tick` with the plant's state at that instant.

    waiting --tick?--> sending (0) --yaw_rad!, yaw_rate_rad_s!, x!, y!--> waiting

    `catch_up` is called before: sensors take what they have to before the plant goes on.
    `x` and `y` are what a tracking system in the room would measure; nothing on board can. They are
    made where there is a listener, and in every recorded run: 1 us and 34 bytes a control tick, for
    the truth that `export` and `debug` show later. On the robot itself there is no world.
    """

    def __init__(self, world: TachobotWorld, now: Now, catch_up: Callable[[], None]) -> None:
        super().__init__("world")
        self.tick = self.in_port("tick", object)
        self.yaw_rad = self.out_port("yaw_rad", float)
        self.yaw_rate_rad_s = self.out_port("yaw_rate_rad_s", float)
        self.x = self.out_port("x", Motion)
        self.y = self.out_port("y", Motion)
        self._world = world
        self._now = now
        self._catch_up = catch_up
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
        self._catch_up()
        self._state = self._world.state(self._now())
        self.activate("sending")
