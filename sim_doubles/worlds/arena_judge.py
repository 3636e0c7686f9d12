"""What the arena's truth says of a mission in which no fault was made.

A robot may come to nothing and report no fault: its head sweeps past the target, it turns the
longer way round, or drives beside the target. Its healthy runs are then alike, and only what the
mission is for says that they are wrong. All of it is looked up in the log, so it does not matter
how often it is asked.
"""

import math
from itertools import pairwise
from typing import Final

from firmware_runtime.devs.time import SECOND
from sim_doubles.worlds.arena import Arena
from sim_doubles.worlds.arena_log import ArenaLog

_SWEEPING: Final = ("Ask motor1 to turn right", "Ask motor1 to turn left")
_STOPS_WITHIN: Final = SECOND
"""Ns from a target in the radar's beam to a head that was told to stop."""
_PINGS: Final = 64
"""Pings that are looked at, the last ones: some 4 s."""
_SURELY_M: Final = 0.1
"""So much nearer than the threshold an echo is one that counts, whatever it is rounded to."""
_LONGEST_TURN_RAD: Final = math.radians(200.0)
"""Half a turn is the longest of all shorter ways."""
_MOST_BESIDE_RAD: Final = math.radians(20.0)
"""Half of the radar's beam, and what compasses are off."""
_FAR_M: Final = 1.0
"""Nearer than this a target that it passes by is soon far beside."""
_STRAIGHT_FOR: Final = 3 * SECOND
_MOST_CURVED_RAD: Final = math.radians(30.0)


class ArenaJudge:
    """Judges a robot to which nothing was done; `threshold_m` is that of its radar."""

    def __init__(self, arena: Arena, log: ArenaLog, threshold_m: float) -> None:
        self._arena, self._log = arena, log
        self._surely_m = threshold_m - _SURELY_M

    def missed(self, at: int) -> str | None:
        """Return what it should have done by an instant, and has not; None where nothing is wrong.

        It can be told where the target is all that stands there: others stop the head, too.
        """
        if len(self._arena.parameters.shapes) > 1:
            return None
        return self._swept_past(at) or self._turned(at) or self._drove(at)

    def _swept_past(self, at: int) -> str | None:
        """Return that the head sweeps on, though the target came into its beam."""
        since = self._log.since("radarController", _SWEEPING)
        if since is None:
            return None
        pings = [each for each in self._log.radar_pings[-_PINGS:] if each.at >= since]
        for before, ping in pairwise(pings):
            enters = math.isinf(before.echo_m) and ping.echo_m <= self._surely_m
            if enters and ping.at <= at - _STOPS_WITHIN:
                ago_s = (at - ping.at) / SECOND
                return f"the target came into its radar's beam {ago_s:.1f} s ago, and it sweeps on"
        return None

    def _turned(self, at: int) -> str | None:
        """Return that it turns the longer way to its target."""
        since = self._log.since("movementController", ("Turn",))
        if since is None or (turned := self._turn(since, at)) <= _LONGEST_TURN_RAD:
            return None
        return f"it has turned by {math.degrees(turned):.0f} degrees to face its target"

    def _drove(self, at: int) -> str | None:
        """Return that it drives up to something else than its target."""
        since = self._log.since("movementController", ("Move forward",))
        if since is None:
            return None
        turned = self._turn(max(since, at - _STRAIGHT_FOR), at)
        if turned > _MOST_CURVED_RAD:
            return f"it turned by {math.degrees(turned):.0f} degrees on the way to its target"
        beside = self._beside(at)
        if beside > _MOST_BESIDE_RAD and self._arena.distance_to_target(at) > _FAR_M:
            return f"it drives {math.degrees(beside):.0f} degrees beside its target"
        return None

    def _turn(self, since: int, until: int) -> float:
        """Return how far it turned between two instants, rad."""
        before, after = self._arena.pose(since), self._arena.pose(until)
        return abs(after.heading_rad - before.heading_rad)

    def _beside(self, at: int) -> float:
        """Return the angle between where it heads and the target, rad."""
        pose = self._arena.pose(at)
        x_m, y_m = self._arena.parameters.target
        bearing = math.atan2(y_m - pose.y_m, x_m - pose.x_m)
        return abs(math.remainder(bearing - pose.heading_rad, math.tau))
