"""The bridge: ports of a running robot over UDP, carried by a process of its own.

    UDP sender <--> socket of this process <--> a RobotEnd of its own <--> the run's socket

A datagram is handed on as it is, in both directions, but for requests to arm, disarm or set: it may
come from anywhere, and this process is the run's own user's. Each UDP sender has an end of its own
at the robot, so the run can distinguish them, and what it answers one of them goes to no other.
`Senders` are bounded in all and by address.

With a key, only what is signed with it is taken, and answers are signed (`signatures`).

Besides, the bridge may watch ports itself, for peers (`broadcast`).

Nothing waits: what does not fit is dropped and counted.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from selectors import EVENT_READ, DefaultSelector
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.bridge.broadcast import Broadcast, Carried, Route
from firmware_runtime.links.bridge.signatures import NotAcquainted, Refused, Signed, Unsigned
from firmware_runtime.links.endpoint import UdpAddress, bound, datagrams, written
from firmware_runtime.links.ports.datagrams import (
    WATCHED_FOR,
    Ask,
    Refusal,
    message_of,
    understood,
)
from firmware_runtime.links.ports.robot_end import RobotEnd

POLL_EVERY: Final = 250 * MILLISECOND
"""Ns from one poll whether there is a run to the next."""


MOST: Final = 64
"""How many UDP senders have an end at the robot."""
MOST_OF_ADDRESS: Final = 8
"""How many of them have the same address: half of those who may watch ports at a time."""
QUIET: Final = WATCHED_FOR + 5 * SECOND
"""Ns after which a sender that says nothing is forgotten."""


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
    """UDP senders, bounded in all and by address, so that none keeps others out.

    A port costs a sender nothing, an address does. So one more port of an address that has
    `MOST_OF_ADDRESS` takes the place of the one that has been quiet longest. Where all places are
    taken, a newcomer takes one from the address that has most. `forget` is called with each that
    loses its place, to close its end.
    """

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


class Bridge:
    """Carries datagrams; `log` is called with a sentence when a run appears or is gone.

    Raises ConfigError if an address cannot be had.
    """

    def __init__(self, route: Route, log: Callable[[str], None]) -> None:
        self._udp = bound("--listen", route.listen)
        self._robot = route.robot
        self._admission: Unsigned | Signed = Unsigned()
        if route.key is not None:
            self._admission = Signed(route.key, monotonic_ns)
        self._carried = Carried()
        self._broadcast = Broadcast(route, self._carried, log)
        self._senders = Senders(self._forget)
        self._poll_at = 0
        self._selector = DefaultSelector()
        self._selector.register(self._udp, EVENT_READ, self._from_udp)
        self._selector.register(self._broadcast, EVENT_READ, self._broadcast.carry)

    @property
    def listens_at(self) -> str:
        """The UDP address, with the port that the kernel chose if it was asked for 0."""
        return written(self._udp.getsockname())

    @property
    def summary(self) -> str:
        """State and counts, in one line."""
        found = "a run listens" if self._broadcast.is_there else "no run"
        carried = self._carried
        counts = f"to it {carried.to_robot}, from it {carried.from_robot}"
        senders = f"senders {len(self._senders)}"
        if self._senders.displaced > 0:
            senders += f" ({self._senders.displaced} displaced)"
        refused = self._admission.refused
        reasons = ", ".join(f"{reason} {count}" for reason, count in sorted(refused.items()))
        not_taken = f", refused {refused.total()} ({reasons})" if refused else ""
        return f"{found}; {senders}, {counts}, dropped {carried.dropped}{not_taken}"

    def wake_by(self, descriptor: int) -> None:
        """Let `work` return early, too, when this becomes readable."""
        self._selector.register(descriptor, EVENT_READ, _nothing)

    def work(self) -> None:
        """Carry what there is; wait for it until the next poll at most."""
        now = monotonic_ns()
        if now >= self._poll_at:
            self._poll_at = now + POLL_EVERY
            self._broadcast.poll(now)
            self._senders.forget_quiet(now)
        for key, _ in self._selector.select((self._poll_at - now) / SECOND):
            key.data()

    def close(self) -> None:
        """Close the sockets."""
        self._senders.close()
        self._selector.close()
        self._broadcast.close()
        self._udp.close()

    # ----------------------------------------------------------------------------------------------

    def _from_udp(self) -> None:
        for datagram, address in datagrams(self._udp, self._admission.longest + 1):
            try:
                self._carry(*self._admission.admit(datagram), address)
            except NotAcquainted as why:
                self._send(address, why.answer)
            except Refused:
                continue  # and counted; an answer would serve those who forge addresses

    def _carry(self, name: str, datagram: bytes, address: UdpAddress) -> None:
        sender = self._senders.find(address) or self._welcome(address)
        sender.spoke_at, sender.name = monotonic_ns(), name
        if _is_request(datagram):
            self._refuse(sender, "a bridge carries no requests; expected port, watch, list or time")
            return
        try:
            sender.end.send(datagram)
        except BlockingIOError:
            self._carried.dropped += 1
        except OSError as error:
            self._refuse(sender, f"no run listens ({error.strerror}); expected one to be alive")
        else:
            self._carried.to_robot += 1

    def _welcome(self, address: UdpAddress) -> Sender:
        """Give a sender an end of its own at the robot."""
        sender = Sender(address, RobotEnd(self._robot), monotonic_ns())
        self._senders.add(sender)
        self._selector.register(sender.end, EVENT_READ, lambda: self._from_robot(sender))
        return sender

    def _from_robot(self, sender: Sender) -> None:
        if self._senders.find(sender.address) is not sender:
            return  # it has just lost its place
        for message in sender.end.received():
            self._answer(sender, message)

    def _refuse(self, sender: Sender, why: str) -> None:
        self._carried.dropped += 1
        self._answer(sender, message_of(error=why))

    def _answer(self, sender: Sender, message: bytes) -> None:
        self._send(sender.address, self._admission.signed(sender.name, message))

    def _send(self, address: UdpAddress, datagram: bytes) -> None:
        try:
            self._udp.sendto(datagram, address)
        except OSError:  # no room, no way there, or more than UDP can carry
            self._carried.dropped += 1
        else:
            self._carried.from_robot += 1

    def _forget(self, sender: Sender) -> None:
        self._selector.unregister(sender.end)
        sender.end.close()


def _is_request(datagram: bytes) -> bool:
    """Return whether the run would do something itself; what it cannot read it refuses itself."""
    try:
        return isinstance(understood(datagram), Ask)
    except Refusal:
        return False


def _nothing() -> None:
    """Do nothing: the caller of `work` polls for the signal that came."""
