"""A tracking system in the room, such as a camera over the floor: late, noisy, with gaps.

It looks every period, and what it saw comes a delay later. It says how old it is, as one that
shares its clock with the robot can. Positions may overlap on their way.

Not modelled: a rate or a delay that wanders, a wrong body taken for the right one.
"""

from collections import deque
from collections.abc import Callable
from statistics import NormalDist
from typing import NamedTuple

from firmware_boards.tachobot.plant_settings import PositionSensorSettings

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import NEVER, SECOND, seconds
from firmware_runtime.models.position_fix import PoseFix, PositionFix
from sim_doubles.clock import Now
from sim_doubles.worlds.noise import InstantNoise


class TruePose(NamedTuple):
    """True pose of a body."""

    x_m: float
    y_m: float
    yaw_rad: float


class PositionSensor(Atomic):
    """Looks every period; sends each position a delay later, with yaw or without.

    watching (to the next look or arrival) --position!, pose!--> watching

    Its period is not declared, so no look is skipped by a loop that is late.
    """

    def __init__(
        self, settings: PositionSensorSettings, pose: Callable[[], TruePose], now: Now
    ) -> None:
        super().__init__("position_sensor")
        self.position = self.out_port("position", PositionFix)
        self.pose = self.out_port("pose", PoseFix)
        self.settings = settings
        self.interval, self.delay = seconds(1 / settings.rate_hz), seconds(settings.delay_s)
        self._outages = [(seconds(begin), seconds(end)) for begin, end in settings.outages_s]
        self._true_pose = pose
        self._now = now
        self._noise = InstantNoise("position", settings.seed, 1.0)
        self._luck = InstantNoise("dropout", settings.seed, 1.0)
        self._at = 0
        self._look_at = self.interval
        self._under_way: deque[tuple[int, TruePose, float]] = deque()

    def initialize(self) -> None:
        """Look after a period."""
        self._hold()

    def output(self) -> None:
        """Send what comes at this instant, both with yaw and without: one of them is coupled."""
        at = self._at + self.sigma
        if self._under_way and self._under_way[0][0] == at:
            _, (x, y, yaw), age_s = self._under_way[0]
            self.position.send(PositionFix(x, y, age_s))
            self.pose.send(PoseFix(x, y, yaw, age_s))

    def internal(self) -> None:
        """Drop what was sent; look if it is time to."""
        self._at += self.sigma
        if self._under_way and self._under_way[0][0] == self._at:
            self._under_way.popleft()
        if self._at == self._look_at:
            self._look()
            self._look_at += self.interval
        self._hold()

    # ---------------------------------------------------------------------------------------------

    def _hold(self) -> None:
        arrival = self._under_way[0][0] if self._under_way else NEVER
        self.hold_in("watching", min(arrival, self._look_at) - self._at)

    def _look(self) -> None:
        settings, at = self.settings, self._at
        if any(begin <= at < end for begin, end in self._outages) or self._is_dropped(at):
            return
        x, y, yaw = self._true_pose()
        noise_x, noise_y, noise_yaw = self._noise.at(at)
        seen = TruePose(
            x + settings.noise_m * noise_x,
            y + settings.noise_m * noise_y,
            yaw + settings.yaw_noise_rad * noise_yaw,
        )
        # The world runs ahead by what transactions take on the wire, so the position is younger.
        ahead = self._now() - at
        age_s = max(self.delay - ahead, 0) / SECOND
        self._under_way.append((at + self.delay, seen, age_s))

    def _is_dropped(self, at: int) -> bool:
        share = self.settings.dropout
        if not 0.0 < share < 1.0:
            return share >= 1.0
        return self._luck.at(at)[0] < NormalDist().inv_cdf(share)
