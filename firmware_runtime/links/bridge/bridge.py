"""The bridge: ports of a running robot over UDP, carried by a process of its own.

    UDP sender <--> socket of this process <--> a RobotEnd of its own <--> the run's socket

A datagram is handed on as it is, in both directions, but for requests to arm, disarm or set: it may
come from anywhere, and this process is the run's own user's. Each UDP sender has an end of its own
at the robot, so the run can distinguish them, and what it answers one of them goes to no other. How
many there may be, and when one is forgotten, `senders` says.

With a key, only what is signed with it is taken, and answers are signed (`admission`).

Besides, the bridge may watch ports itself, for peers (`broadcast`).

Nothing waits: what does not fit is dropped and counted.
"""

from collections.abc import Callable
from selectors import EVENT_READ, DefaultSelector
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.bridge.admission import Admission, NotAcquainted, Signed, Unsigned
from firmware_runtime.links.bridge.broadcast import Broadcast
from firmware_runtime.links.bridge.envelope import Refused
from firmware_runtime.links.bridge.route import Carried, Route
from firmware_runtime.links.bridge.senders import Sender, Senders, UdpAddress
from firmware_runtime.links.endpoint import bound, written
from firmware_runtime.links.ports.datagrams import Ask, Refusal, message_of, understood
from firmware_runtime.links.ports.robot_end import AT_ONCE, RobotEnd

POLL_EVERY: Final = 250 * MILLISECOND
"""Ns from one poll whether there is a run to the next."""


class Bridge:
    """Carries datagrams; `log` is called with a sentence when a run appears or is gone.

    Raises ConfigError if an address cannot be had.
    """

    def __init__(self, route: Route, log: Callable[[str], None]) -> None:
        self._udp = bound("--listen", route.listen)
        self._robot = route.robot
        self._admission: Admission = (
            Unsigned() if route.key is None else Signed(route.key, monotonic_ns)
        )
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
        """How it goes, in one line."""
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
        for _ in range(AT_ONCE):
            try:
                datagram, address = self._udp.recvfrom(self._admission.longest + 1)
            except OSError:
                return
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
    """Whether the run would do something itself; what it would not understand it says itself."""
    try:
        return isinstance(understood(datagram), Ask)
    except Refusal:
        return False


def _nothing() -> None:
    """What is to be done when a signal came: the caller of `work` polls for it."""
