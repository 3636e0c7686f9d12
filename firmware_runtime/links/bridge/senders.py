"""Who speaks through a bridge: bounded in all and by address, so that none keeps others out.

A port costs a sender nothing, an address does. So one address has `MOST_OF_ADDRESS` ends at the
robot at most: one more port of it takes the place of the one that has been quiet longest. Where all
places are taken, a newcomer takes one from the address that has most.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.time import SECOND
from firmware_runtime.links.ports.robot_end import RobotEnd
from firmware_runtime.links.ports.watchers import WATCHED_FOR

MOST: Final = 64
"""How many UDP senders have an end at the robot."""
MOST_OF_ADDRESS: Final = 8
"""How many of them have the same address: half of those who may watch ports at a time."""
QUIET: Final = WATCHED_FOR + 5 * SECOND
"""Ns after which a sender that says nothing is forgotten."""

UdpAddress: TypeAlias = tuple[Any, ...]


@dataclass(slots=True)
class Sender:
    """A UDP sender, its end at the robot, and when it said something last."""

    address: UdpAddress
    end: RobotEnd
    spoke_at: int
    name: str = ""
    """By which it signs, and its answers name it; empty where nothing is signed."""

    @property
    def host(self) -> str:
        """Its address without the port."""
        return str(self.address[0])


class Senders:
    """All of them; `forget` is called with each that loses its place, to close its end."""

    def __init__(self, forget: Callable[[Sender], None]) -> None:
        self.displaced = 0
        """How many lost their place to another."""
        self._forget = forget
        self._all: dict[UdpAddress, Sender] = {}

    def __len__(self) -> int:
        return len(self._all)

    def find(self, address: UdpAddress) -> Sender | None:
        """The sender with this address and port, if it has a place."""
        return self._all.get(address)

    def add(self, sender: Sender) -> None:
        """Give a newcomer a place, if need be that of another."""
        of_host = Counter(each.host for each in self._all.values())
        if of_host[sender.host] >= MOST_OF_ADDRESS:
            self._displace(sender.host)
        elif len(self._all) >= MOST:
            self._displace(of_host.most_common(1)[0][0])
        self._all[sender.address] = sender

    def forget_quiet(self, now: int) -> None:
        """Forget those who have said nothing for `QUIET`."""
        for sender in [each for each in self._all.values() if now - each.spoke_at > QUIET]:
            self._remove(sender)

    def close(self) -> None:
        """Forget all."""
        for sender in list(self._all.values()):
            self._remove(sender)

    def _displace(self, host: str) -> None:
        of_host = (each for each in self._all.values() if each.host == host)
        self._remove(min(of_host, key=lambda each: each.spoke_at))
        self.displaced += 1

    def _remove(self, sender: Sender) -> None:
        del self._all[sender.address]
        self._forget(sender)
