"""Leases on an armed robot: a process that armed it must say again and again that it is alive.

    arm with lease_s --> armed --renew, in time--> armed
    armed --no renewal for lease_s--> disarmed

So a robot that a process armed does not stay armed when that process is gone, or stuck. Several may
have a lease at a time: each that runs out disarms. Whatever else disarms the robot ends them all,
unless it is to be armed again by itself, as after a silence of its link: then it needs them still.
"""

import secrets
from collections.abc import Callable
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.runs.arming import Arming

SHORTEST_S: Final = 0.05
LONGEST_S: Final = 60.0
AT_ONCE: Final = 16
"""How many requests are read before a lease is taken to have run out."""


class Leases:
    """A hook of the run. `read` handles one request that waits, and says whether there was one."""

    def __init__(
        self,
        arming: Arming,
        read: Callable[[], bool] = lambda: False,
        now: Callable[[], int] = monotonic_ns,
    ) -> None:
        self._arming = arming
        self._read = read
        self._now = now
        self._lengths: dict[str, int] = {}
        self._ends: dict[str, int] = {}

    def take(self, lease_s: object) -> str:
        """A new lease on a robot that is armed; its name. Raises ConfigError for no such time."""
        lease = secrets.token_hex(8)
        self._lengths[lease] = length(lease_s)
        self.renew(lease, self._now())
        return lease

    def renew(self, lease: object, sent_at: int) -> bool:
        """Whether there was such a lease; then it begins again at the instant of the renewal, ns.

        One that a run which stood still finds when it goes on may be old, and its sender gone.
        """
        if not isinstance(lease, str) or lease not in self._lengths:
            return False
        self._ends[lease] = max(self._ends.get(lease, 0), sent_at + self._lengths[lease])
        return True

    def between_steps(self, _now: int, _left: int) -> None:
        """Disarm when a lease has run out, of which no renewal waits to be read."""
        if not self._ends:
            return
        if not (self._arming.armed or self._arming.is_wanted):
            self._end()
        elif self._first_end() <= self._now():
            for _ in range(AT_ONCE):
                if not self._read():
                    break
            self._judge()

    def _judge(self) -> None:
        now = self._now()
        out = [lease for lease, end in self._ends.items() if end <= now]
        if out:
            length_s = self._lengths[out[0]] / SECOND
            self._end()
            self._arming.disarm(f"no sign for {length_s:g} s of the process that armed it")

    def _first_end(self) -> int:
        return min(self._ends.values(), default=NEVER)

    def _end(self) -> None:
        self._lengths.clear()
        self._ends.clear()


def length(lease_s: object) -> int:
    """A lease's time in ns. Raises ConfigError."""
    is_number = isinstance(lease_s, int | float) and not isinstance(lease_s, bool)
    if not (is_number and SHORTEST_S <= lease_s <= LONGEST_S):  # type: ignore[operator] # a number
        expected = f"expected seconds, from {SHORTEST_S:g} to {LONGEST_S:g}"
        raise ConfigError("request", [f"lease_s: {lease_s!r}: {expected}"])
    return round(lease_s * SECOND)  # type: ignore[operator] # likewise
