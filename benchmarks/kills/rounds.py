"""Rounds of kills, and the lateness of the run's loop in spans with kills and without."""

import sys
from collections.abc import Callable, Mapping, Sequence
from random import Random
from time import monotonic, monotonic_ns
from typing import Any, Final

from benchmarks.kills.killed import Killed
from benchmarks.kills.kills import Kills
from benchmarks.kills.linked_robot import LinkedRobot
from benchmarks.kills.noded_robot import NodedRobot
from benchmarks.kills.processes import Processes
from benchmarks.kills.standstill import Standstills
from firmware_runtime.statistics.comparison import difference, merged
from firmware_runtime.statistics.statistics import Statistics

TURNS: Final = 3
"""How often spans of each kind take turns."""
WITHIN_S: Final = 0.25
"""A kill comes within this after the robot drives, unless it is said otherwise."""


class Rounds:
    """Kills of each part so far, at instants that a seed decides, and what was compared."""

    def __init__(self, seed: int, drives_s: float = WITHIN_S) -> None:
        self.standstills: Standstills | None = None
        """Watches the machine, where nothing is compared that it would disturb."""
        self.kills: dict[str, Kills] = {}
        self.lateness: dict[str, dict[str, Any]] = {}
        self._seed = seed
        self._drives_s = drives_s
        self._randoms: dict[str, Random] = {}

    def of(
        self, what: str, robot: LinkedRobot | NodedRobot, kill: Callable[[], Killed], count: int
    ) -> None:
        """Kill one part so often; another was started when `kill` returns."""
        kills = self.kills.setdefault(what, Kills())
        random = self._randoms.setdefault(what, Random(f"{self._seed} {what}"))  # noqa: S311
        for _ in range(count):
            robot.wait_until_driving()
            robot.pause(random.uniform(0, self._drives_s))
            killed = kill()
            off_at = _off_at(robot, killed.before)
            robot.wait_until_driving()
            kills.note(killed, off_at, robot.record.on_after(off_at), self._stood_still_ms)
            if (done := len(kills.took_ms)) % 10 == 0:
                say(f"{what}: {done} kills, outputs off after {kills.took_ms[-1]:.0f} ms")

    def share_of(
        self, what: str, robot: LinkedRobot | NodedRobot, kill: Callable[[], Killed], count: int
    ) -> None:
        """A turn's share of so many kills."""
        done = len(self.kills[what].took_ms) if what in self.kills else 0
        self.of(what, robot, kill, min(-(-count // TURNS), count - done))

    def compare(
        self, what: str, robot: Processes, during: Mapping[str, Sequence[Callable[[], None]]]
    ) -> None:
        """Lateness of one run in spans of several kinds, in turns, and ratios of the first to them.

        A kind has what comes before its span, if anything, and what is done in it. The first says
        how long the others are. The run must outlive all of them.
        """
        spans: dict[str, list[Statistics]] = {name: [] for name in during}
        for turn in range(TURNS):
            for number, (name, (*before, inside)) in enumerate(during.items()):
                for each in before:
                    each()
                earlier, kills, began = robot.read(), self._count, monotonic()
                inside()
                if number == 0:
                    robot.last_like(monotonic() - began, self._count - kills)
                spans[name].append(difference(robot.read(), earlier))
            say(f"lateness beside {what}: {turn + 1} of {TURNS} turns")
        p99 = {name: _p99_us(each) for name, each in spans.items()}
        first, *others = p99
        ratios = {f"{first} to {name}": p99[first] / p99[name] for name in others}
        self.lateness[what] = {"p99_us": p99, "ratio": ratios}

    @property
    def _count(self) -> int:
        return sum(len(each.took_ms) for each in self.kills.values())

    def _stood_still_ms(self, begin: int, end: int) -> float | None:
        watched = self.standstills
        return None if watched is None else watched.longest_ms(begin, end)


def say(line: str) -> None:
    """Show on standard error how far it is."""
    sys.stderr.write(f"kills: {line}\n")
    sys.stderr.flush()


def _p99_us(spans: Sequence[Statistics]) -> float:
    found = merged(spans).figures().models["imu"].lateness_us.p99
    return 0.0 if found is None else found


def _off_at(robot: Processes, at: int) -> int:
    """Wait until all outputs are off; since when they were."""
    found: list[int] = []

    def is_off() -> bool:
        off_at = robot.record.off_since(at, monotonic_ns)
        found.extend([] if off_at is None else [off_at])
        return bool(found)

    robot.wait_until(is_off, "all outputs are off")
    return found[0]
