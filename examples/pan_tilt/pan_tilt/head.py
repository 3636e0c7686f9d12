"""Where the head is to look: on by the rates it is given while it follows, to and fro else."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.motion import Applied

SWEEP_PERIOD = 20 * MILLISECOND
LONGEST = 100 * MILLISECOND
"""For so long, ns, a rate is added up at most: what it comes from was seen no longer before."""


class Head(Atomic):
    """Adds rates up to angles; sweeps by itself while there is nothing to follow.

    waiting --follow? 0--> sweeping, --follow? 1--> following
    sweeping (SWEEP_PERIOD) --pan! tilt!--> sweeping
    sweeping --follow? 1--> following;  following --follow? 0--> sweeping
    following --pan_rate?, tilt_rate?--> turning (0) --pan! tilt!--> following
    any --applied?--> telling (0) --pan_effect! tilt_effect!--> waiting, sweeping, following

    Until the eyes have looked once it sends no angle: what it cannot see it does not turn.
    While the servos apply nothing the angles stay, and are sent: a servo begins with the first. At
    `pan_effect` and `tilt_effect` leaves what becomes of the rates, where that is new: what the
    servos apply, and no more than PART at the end of a way.
    """

    def __init__(
        self, name: str, limits: tuple[tuple[float, float], tuple[float, float]], sweep_rad_s: float
    ) -> None:
        super().__init__(name)
        self.follow = self.in_port("follow", int)
        self.pan_rate = self.in_port("pan_rate", float)
        self.tilt_rate = self.in_port("tilt_rate", float)
        self.applied_in = self.in_port("applied", Applied)
        self.pan = self.out_port("pan", float)
        self.tilt = self.out_port("tilt", float)
        self.pan_effect = self.out_port("pan_effect", Applied)
        self.tilt_effect = self.out_port("tilt_effect", Applied)
        self.limits = limits
        self.angles = [0.0, 0.0]
        """Pan and tilt as commanded, rad."""
        self.is_following: bool | None = None
        """None until the eyes have looked."""
        self.applied = Applied.NOTHING
        self.effects_sent: list[Applied] = [Applied.ALL, Applied.ALL]
        self._sweep_rad_s = sweep_rad_s
        self._since = 0

    def initialize(self) -> None:
        """Wait for what the eyes see first."""
        self._wait()

    def output(self) -> None:
        """Send both angles, and what has changed of their effects."""
        if self.phase != "telling":
            self.pan.send(self.angles[0])
            self.tilt.send(self.angles[1])
        for axis, port in enumerate((self.pan_effect, self.tilt_effect)):
            if (effect := self._effect(axis)) is not self.effects_sent[axis]:
                port.send(effect)

    def internal(self) -> None:
        """Go on with the sweep, or wait for the next rates."""
        self.effects_sent = [self._effect(axis) for axis in range(2)]
        if self.phase == "sweeping" and self.applied is not Applied.NOTHING:
            self._sweep()
        self._wait()

    def external(self, elapsed: int) -> None:
        """Take up or give up following; turn by the rates over the time that passed."""
        self._since += elapsed
        if self.applied_in:
            self.applied = self.applied_in[-1]
        if self.follow:
            self.is_following = self.follow[-1] == 1
            self._since = 0
            self._wait()
        elif self.is_following and (self.pan_rate or self.tilt_rate):
            self._turn()
        elif self.applied_in:
            self.activate("telling")
        else:
            self.continue_(elapsed)

    def _wait(self) -> None:
        if self.is_following is None:
            self.passivate("waiting")
        elif self.is_following:
            self.passivate("following")
        else:
            self.hold_in("sweeping", SWEEP_PERIOD)

    def _turn(self) -> None:
        seconds, self._since = min(self._since, LONGEST) / SECOND, 0
        if self.applied is not Applied.NOTHING:
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

    def _effect(self, axis: int) -> Applied:
        least, most = self.limits[axis]
        is_at_an_end = not least < self.angles[axis] < most
        return min(self.applied, Applied.PART) if is_at_an_end else self.applied
