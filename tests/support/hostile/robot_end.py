"""The robot's end of a link as it is: a carrier and a run's link, at an instant set from outside.

Only sockets lead to an attacker here instead of to a network.
"""

import socket
from collections import Counter
from contextlib import ExitStack
from typing import Final
from unittest.mock import patch

from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.links.cut import udp
from firmware_runtime.links.cut.channel import Channel
from firmware_runtime.links.cut.cut import Terms
from firmware_runtime.models.motion import Motion
from tests.support.hostile.frames import KEY, YAW_LIMIT
from tests.support.hostile.link_rules import MS
from tests.support.link_rig import link_of, role_of

TIMEOUT: Final = 500 * MS


PORTS: Final = {
    "controller.motion": Motion,
    "controller.turn": str,
    "controller.yaw": float,
    "robot.forces": float,
}


class RobotEnd:
    """A carrier and a run's link, tied by sockets, at an instant that is set from outside."""

    def __init__(self, stack: ExitStack) -> None:
        self.now = 1000 * 1000 * MS
        stack.enter_context(patch.object(udp, "monotonic_ns", lambda: self.now))
        run, to_run = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._network, to_network = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        for each in (run, to_run, self._network, to_network):
            each.setblocking(False)
            stack.callback(each.close)
        self.carrier = udp.Carrier(to_run, to_network, KEY, None)
        self.link = link_of(
            role_of(PORTS, "robot"),
            Channel(run),
            Terms(timeout=TIMEOUT, ordered=frozenset({"controller.turn"})),
            lambda: self.now,
            limits={"controller.yaw": (-YAW_LIMIT, YAW_LIMIT)},
            clock=MonotonicClock(),
        )
        self.link.between_steps(0, 0)  # its first greeting: the carrier knows its session by it
        self.carrier.work()

    def refused(self) -> Counter[str]:
        """By reason, at the carrier and at the run."""
        both = Counter(self.link.counts.own)
        both.update(self.carrier.carried.refused)
        return Counter({reason.value: count for reason, count in both.items() if count})

    def counted(self) -> dict[str, int]:
        """Values that arrived and did not enter, by what became of them."""
        self.link.between_steps(0, 0)
        return {"overtaken": self.link.counts.overtaken, "dropped": self.link.counts.dropped}

    def lacks(self) -> bool:
        """Whether it is kept from driving by what it lacks."""
        link = self.link
        return bool(link.lacks_at(self.now) <= self.now)

    def take(self, datagram: bytes) -> list[tuple[str, object]]:
        """Let a datagram come; the values that enter the model."""
        self._network.send(datagram)
        self.carrier.work()
        return [(port.name, value) for bag in self.link.events() for port, value in bag]
