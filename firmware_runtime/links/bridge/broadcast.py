"""Output ports of a running robot for peers who need not ask, and whether there is a run at all."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from firmware_runtime.links.endpoint import Endpoint, connected
from firmware_runtime.links.ports.datagrams import RENEW_EVERY, message_of, said_in
from firmware_runtime.links.ports.robot_end import RobotEnd


@dataclass(frozen=True, slots=True)
class Route:
    """Way on which a bridge carries datagrams."""

    robot: Path
    """The run's statistics: its socket is beside them."""
    listen: Endpoint
    peers: Sequence[Endpoint] = ()
    watch: Sequence[str] = ()
    """Output ports for the peers, every N-th message of each."""
    every: int = 1
    key: bytes | None = None
    """What senders and answers are signed with; without it `listen` is a loopback address."""


@dataclass(slots=True)
class Carried:
    """Datagrams since the bridge began."""

    to_robot: int = 0
    from_robot: int = 0
    dropped: int = 0
    """Those that found no room, no run, or no reader."""


class Broadcast:
    """Watches ports and sends what they send to every peer; nothing is read from a peer.

    `log` is called with a sentence when a run appears or is gone. Raises ConfigError for a peer
    that there is no way to.
    """

    def __init__(self, route: Route, carried: Carried, log: Callable[[str], None]) -> None:
        self.is_there: bool | None = None
        self._peers = [connected("--peer", peer) for peer in route.peers]
        self._request = message_of(watch=route.watch, every=route.every) if route.watch else b""
        self._end = RobotEnd(route.robot)
        self._carried = carried
        self._log = log
        self._refusal = ""
        self._renew_at = 0

    def fileno(self) -> int:
        """The descriptor that becomes readable when the robot has said something."""
        return self._end.fileno()

    def poll(self, now: int) -> None:
        """Find the run, and ask it again before it forgets."""
        absent = self._end.why_absent()
        if self.is_there is not (absent == ""):
            self.is_there, self._refusal, self._renew_at = absent == "", "", now
            what = f"no run listens ({absent}); waiting for one" if absent else "a run listens"
            self._log(f"{self._end.path}: {what}")
        if self.is_there and self._request and now >= self._renew_at:
            self._renew_at = now + RENEW_EVERY
            with suppress(OSError):  # gone since, or busy: the next time, then
                self._end.send(self._request)

    def carry(self) -> None:
        """Hand on what the robot has said; a refusal is reported once."""
        for message in self._end.received():
            said = said_in(message)
            if said.port:
                self._send(message)
            elif said.error not in ("", self._refusal):
                self._refusal = said.error
                self._log(f"the run refuses: {said.error}")
        if not self._end.is_connected:  # the next one knows nothing
            self.is_there = None

    def close(self) -> None:
        """Close the sockets."""
        self._end.close()
        for peer in self._peers:
            peer.close()

    def _send(self, message: bytes) -> None:
        for peer in self._peers:
            try:
                peer.send(message)
            except OSError:  # no reader at the moment, no room, or more than UDP can carry
                self._carried.dropped += 1
            else:
                self._carried.from_robot += 1
