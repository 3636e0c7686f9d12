"""For programs: values into the ports of a running robot, and what its ports send.

    with PortsClient("robot.local:7300", key=Path("robot.key")) as robot:
        robot.put("yaw_reference", 0.5)
        for message in robot.watch(["controller.yaw.command_n"], every=10):
            print(message.t_ns, message.value)

Through a bridge, signed with its key; on the robot itself also by the Path of its statistics.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from select import select
from time import monotonic_ns
from typing import Any, Final

import msgspec

from firmware_runtime.devs.time import NEVER, SECOND, seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.bridge.bridge_end import BridgeEnd
from firmware_runtime.links.endpoint import endpoint
from firmware_runtime.links.key_file import read_key
from firmware_runtime.links.ports.datagrams import RENEW_EVERY, TIMEOUT, Said, message_of, said_in
from firmware_runtime.links.ports.robot_end import NoAnswer, RobotEnd
from firmware_runtime.system.resources import Closing

ROOM: Final = 1024
"""Messages that wait to be read; then the oldest makes room."""


class Message(msgspec.Struct, frozen=True):
    """One value that left an output port, and the instant of the run at which it did."""

    port: str
    t_ns: int
    value: Any


class PortsClient(Closing):
    """Speaks with the ports of one run; a context manager.

    `where` is a bridge's ADDRESS:PORT, or the path of the statistics of a run on
    this machine. Raises ConfigError for
    an address or a key that is none, for one of another machine without a key, and for what the run
    refuses; NoAnswer if it does not answer.
    """

    def __init__(self, where: str | Path, key: Path | None = None) -> None:
        self.where = str(where)
        self._end: RobotEnd | BridgeEnd
        self._received: deque[Said] = deque()
        self._messages: deque[Message] = deque(maxlen=ROOM)
        self._may_need_key = False
        if isinstance(where, Path):
            if key is not None:
                raise ConfigError.of_one(
                    "key file", f"{key}: a run's own socket takes no key", "a bridge's address"
                )
            self._end = RobotEnd(where)
            return
        at = endpoint("bridge", where)
        if key is None and not at.is_loopback:
            raise ConfigError.of_one(
                "bridge", f"{at} is not on this machine", "a key file, as its bridge has one"
            )
        secret = None if key is None else read_key(key)
        self._may_need_key = key is None
        try:
            self._end = BridgeEnd(at, secret)
        except OSError as error:
            raise NoAnswer(
                error.strerror or error, where=self.where, expected="a way there"
            ) from error

    def put(self, port: str, value: object) -> None:
        """Put a value into an input port of the model; returns when it has arrived.

        After NoAnswer it may have arrived or not; later it does not arrive any more.
        """
        self._ask("taken", port=port, value=value, confirm=True)

    def ports(self) -> tuple[dict[str, str], ...]:
        """Name, direction and type of each port."""
        return self._ask("ports", list=True).ports or ()

    def watch(
        self, ports: Sequence[str], every: int = 1, for_s: float | None = None
    ) -> Iterator[Message]:
        """Every N-th message of these output ports, for so long, or until the run falls silent."""
        until = NEVER if for_s is None else monotonic_ns() + seconds(for_s)
        renew_at = 0
        try:
            while (now := monotonic_ns()) < until:
                if now >= renew_at:
                    renew_at = now + RENEW_EVERY
                    self._ask("watching", watch=ports, every=every)
                while self._messages:
                    yield self._messages.popleft()
                self._keep(self._receive(min(until, renew_at)))
            yield from self._messages
        finally:
            self._messages.clear()
            with suppress(NoAnswer):
                self._say(message_of(watch=[]))

    def close(self) -> None:
        """Close the socket."""
        self._end.close()

    # ---------------------------------------------------------------------------------------------

    def _ask(self, key: str, **request: object) -> Said:
        """Say something, and wait for the answer that has this key."""
        self._say(message_of(**request))
        until = monotonic_ns() + TIMEOUT
        while monotonic_ns() < until:
            said = self._receive(until)
            if said is not None and said.error:
                raise ConfigError.of_one(self.where, said.error)
            if said is not None and getattr(said, key):
                return said
            self._keep(said)
        why = self._end.why_not_believed
        self._end.forget()
        expected = "expected a run that listens there"
        if self._may_need_key:
            expected += "; a bridge with a key answers only what is signed with it: --key FILE"
        fault = why or f"no answer within {TIMEOUT // SECOND} s"
        raise NoAnswer(f"{fault}; {expected}", where=self.where)

    def _keep(self, said: Said | None) -> None:
        """A message that comes while something else is waited for."""
        if said is not None and said.port:
            self._messages.append(Message(said.port, said.t_ns, said.value))

    def _say(self, content: bytes) -> None:
        with self._reached():
            self._end.send(content)

    def _receive(self, until: int) -> Said | None:
        """Return what is said next, if anything comes until then."""
        if not self._received:
            select([self._end], (), (), max(0, until - monotonic_ns()) / SECOND)
            with self._reached():
                self._received.extend(said_in(content) for content in self._end.received())
        return self._received.popleft() if self._received else None

    @contextmanager
    def _reached(self) -> Iterator[None]:
        try:
            yield
        except NoAnswer:
            raise
        except OSError as error:
            fault = f"{self.where}: {error.strerror or error}"
            expected = "expected a run or a bridge that listens there"
            raise NoAnswer(f"{fault}; {expected}") from error
        except msgspec.MsgspecError as error:
            fault = f"{self.where}: answered with what is no JSON of a run ({error})"
            raise NoAnswer(fault, expected="a run") from error
