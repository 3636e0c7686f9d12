"""Where the head is to look: on by the rates it is given while it follows, to and fro else."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND, SECOND

SWEEP_PERIOD = 20 * MILLISECOND


class Head(Atomic):
    """Adds rates up to angles; sweeps by itself while there is nothing to follow.

    sweeping (SWEEP_PERIOD) --pan! tilt!--> sweeping
    sweeping --follow? 1--> following;  following --follow? 0--> sweeping
    following --pan_rate?, tilt_rate?--> turning (0) --pan! tilt!--> following
    """

    def __init__(
        self, name: str, limits: tuple[tuple[float, float], tuple[float, float]], sweep_rad_s: float
    ) -> None:
        super().__init__(name)
        self.follow = self.in_port("follow", int)
        self.pan_rate = self.in_port("pan_rate", float)
        self.tilt_rate = self.in_port("tilt_rate", float)
        self.pan = self.out_port("pan", float)
        self.tilt = self.out_port("tilt", float)
        self.limits = limits
        self.angles = [0.0, 0.0]
        """Pan and tilt as commanded, rad."""
        self.is_following = False
        self._sweep_rad_s = sweep_rad_s
        self._since = 0

    def initialize(self) -> None:
        """Search."""
        self.hold_in("sweeping", SWEEP_PERIOD)

    def output(self) -> None:
        """Send both angles."""
        if self.phase == "sweeping":
            self._sweep()
        self.pan.send(self.angles[0])
        self.tilt.send(self.angles[1])

    def internal(self) -> None:
        """Go on with the sweep, or wait for the next rates."""
        if self.is_following:
            self.passivate("following")
        else:
            self.hold_in("sweeping", SWEEP_PERIOD)

    def external(self, elapsed: int) -> None:
        """Take up or give up following; turn by the rates over the time that passed."""
        self._since += elapsed
        if self.follow:
            self._take_up(self.follow[-1] == 1)
        elif self.is_following and (self.pan_rate or self.tilt_rate):
            self._turn()
        else:
            self.continue_(elapsed)

    def _take_up(self, is_following: bool) -> None:  # noqa: FBT001 -- the value of a port
        self.is_following = is_following
        self._since = 0
        if is_following:
            self.passivate("following")
        else:
            self.hold_in("sweeping", SWEEP_PERIOD)

    def _turn(self) -> None:
        seconds, self._since = self._since / SECOND, 0
        for axis, rates in enumerate((self.pan_rate, self.tilt_rate)):
            if rates:
                self._set(axis, self.angles[axis] + rates[-1] * seconds)
        self.activate("turning")

    def _sweep(self) -> None:
        """To one end of the pan and back again; the tilt goes level."""
        step = self._sweep_rad_s * SWEEP_PERIOD / SECOND
        self._set(0, self.angles[0] + step)
        self._set(1, self.angles[1] - max(-abs(step), min(abs(step), self.angles[1])))
        least, most = self.limits[0]
        if not least < self.angles[0] < most:
            self._sweep_rad_s = -self._sweep_rad_s

    def _set(self, axis: int, angle: float) -> None:
        least, most = self.limits[axis]
        self.angles[axis] = max(least, min(most, angle))
