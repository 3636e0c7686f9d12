"""The paper's mission in a few lines, without chips and models, for tests of the arena alone."""

from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.worlds.arena import ArenaParameters
from sim_doubles.worlds.arena_log import ArenaLog
from tests.support.arena_rig import ArenaRig

HOP = 10 * MILLISECOND
PING = 65 * MILLISECOND
LATE = 35 * MILLISECOND
"""From a ping to its echo in the robot's hands."""
READ = 20 * MILLISECOND
HALF_SWEEP = 6 * SECOND
SPEED = 8
NEAR_M = 0.43
TOLERANCE_DEG = 3.0
LAST = 180 * SECOND


class ArenaMission:
    """Drives ahead and sweeps until the radar has an echo, turns there, drives up to it."""

    def __init__(self, parameters: ArenaParameters) -> None:
        self.rig = ArenaRig(parameters)
        self.log = ArenaLog(self.rig.arena)
        self.at = 0

    def run(self) -> None:
        """Run to the stop, at `at`, or give up after three minutes."""
        self._search()
        self._turn()
        self._approach()
        self.at += SECOND

    def _search(self) -> None:
        self._drive("search", 1, 1)
        side, reverses_at = 1.0, self.at + HALF_SWEEP
        self.rig.turn_head(self.at, side)
        while not self.log.radar_echoes(self.at) and self.at < LAST:
            self.at += PING
            if self.at >= reverses_at:
                side, reverses_at = -side, reverses_at + HALF_SWEEP
                self.rig.turn_head(self.at, side)
        self.at += LATE + 3 * HOP
        self.rig.turn_head(self.at, 0.0)
        self.at += HOP
        self._drive("look", 0, 0)
        self.at += 50 * MILLISECOND

    def _turn(self) -> None:
        arena = self.rig.arena
        target = arena.radar_bearing_deg(self.at)
        grows = 0.0 < (target - arena.body_bearing_deg(self.at)) % 360.0 < 180.0
        self._drive("turn", 1 if grows else -1, -1 if grows else 1)
        while self._off_deg(target) > TOLERANCE_DEG and self.at < LAST:
            self.at += READ
        self.at += 4 * HOP

    def _off_deg(self, target: float) -> float:
        off = (target - self.rig.arena.body_bearing_deg(self.at)) % 360.0
        return min(off, 360.0 - off)

    def _approach(self) -> None:
        self._drive("approach", 1, 1)
        while min(self.log.body_echoes(self.at), default=LAST) > NEAR_M and self.at < LAST:
            self.at += PING
        self.at += LATE + 4 * HOP
        self._drive("stop", 0, 0)

    def _drive(self, state: str, right: int, left: int) -> None:
        self.log.enter(self.at, "mission", state)
        self.rig.drive(self.at, right * SPEED, left * SPEED, step=10)
