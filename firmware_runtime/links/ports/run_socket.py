"""The socket of a run on its machine: values into its model, what its ports send, and requests.

A Unix socket beside the statistics (`BOARD.socket`) that other processes connect to; one message of
theirs or of the run is one packet, and what may be said is in `datagrams`. To the loop it is a
source: a value enters the model as an external event of the next pass, like any other input.

The kernel names the sender, at both ends. A process that may write to the socket may put values in
and watch ports; what arms, disarms and changes settings is for root and the run's own user alone.
The run greets each connection: what was said before that, while it stood still, is of unknown age,
and of it only `disarm` is obeyed.

It costs the loop little, and never more than a bounded amount:

- messages are read between two steps, `AT_ONCE` a pass at most and one request, each time from the
  connection that has waited longest; the others wait in the kernel, each in its own connection;
- a port that is watched costs the step one append a message, any other nothing (`outgoing`);
- what ports send, and what answers a question about them, is sent after the step, while there is
  time left until the next event; a loop that is late sends nothing but answers to requests;
- nothing waits: what finds no room, here or in a reader's own connection, is dropped and counted.
"""

import errno
import select
import socket
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic_ns
from types import MappingProxyType
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.control import Answer, Desk, Respond
from firmware_runtime.links.local_socket import Connection, SocketFile
from firmware_runtime.links.ports.datagrams import (
    GREETING,
    LONGEST,
    TIMEOUT,
    Ask,
    List,
    Put,
    Refusal,
    Time,
    Watch,
    message_of,
    understood,
)
from firmware_runtime.links.ports.outgoing import Outgoing
from firmware_runtime.links.ports.ports import Ports

AT_ONCE: Final = 8
"""How many messages are read in one pass of the loop."""
MOST: Final = 128
"""How many connections there may be."""
MOST_OF_OTHERS: Final = 32
"""How many of them may be of users that may not drive."""

_NO_DESCRIPTOR: Final = {errno.EMFILE, errno.ENFILE}

Arrival: TypeAlias = tuple[InPort[Any], object]


class RunSocket:
    """A source of the executive's loop, and a hook of its run from its first connection on.

    It closes with the run.
    `ports` are those of its model that others may write and watch, None for none of them; `answers`
    has a function for every request, and `slow` how many ns it may take. Its mode is 0660 less the
    umask: never open to all. `now` is any clock in ns that does not stand still. Raises ConfigError
    if the socket cannot be made.
    """

    def __init__(  # noqa: PLR0913 -- put together once, by the run
        self,
        path: Path,
        executive: Executive,
        ports: Ports | None = None,
        *,
        answers: Mapping[str, Respond] = MappingProxyType({}),
        slow: Mapping[str, int] = MappingProxyType({}),
        now: Callable[[], int] = monotonic_ns,
    ) -> None:
        self.desk = Desk(answers, slow)
        self._received = self._refused = 0
        self._ports = ports or Ports(Coupled("none"))
        self._listing = self._ports.listing()
        self._outgoing = Outgoing(executive, self._ports, now)
        self._run_now = executive.clock.now
        self._post = executive.inbox.post
        self._file = SocketFile(path, kind=socket.SOCK_SEQPACKET)
        self._file.socket.listen(MOST)
        self._connections: dict[int, Connection] = {}
        self._poll = select.epoll()
        self.fileno: Callable[[], int] = self._poll.fileno
        """Returns the descriptor that becomes readable when there is a message, or another
        connection; a function written in C, as each wait asks for it.
        """
        self._poll.register(self._file.socket, select.EPOLLIN)
        self._has_asked = False
        self._is_full = False
        """Whether it takes no connection until one has ended: there was no descriptor for it."""
        self._hooks = executive.hooks
        executive.add_source(self)

    def close(self) -> None:
        """Stop listening, and remove the socket; that of another run in its place stays."""
        for connection in self._connections.values():
            connection.close()
        self._connections.clear()
        self._poll.close()
        self._file.close()

    # What the loop asks for -----------------------------------------------------------------------

    def receive(self) -> Sequence[Arrival]:
        """The values that have come; note which ports are watched, and answer one request."""
        arrivals: list[Arrival] = []
        for _ in range(AT_ONCE):
            read = self._read()
            if read is None:
                break
            arrivals += read
            if self._has_asked:
                break
        return arrivals

    def read_next(self) -> bool:
        """Read one message, whatever else is under way; whether there was one."""
        read = self._read()
        for port, value in read or ():
            self._post(port, value)
        return read is not None

    def between_steps(self, now: int, left: int) -> None:
        """Answer what has waited for time, and send what is to be sent, as far as there is some."""
        if self.desk.waiting:
            self.desk.between_steps(now, left)
        if self._connections:
            self._outgoing.between_steps(now, left)

    def counts(self) -> dict[str, int]:
        """Return the counters of all messages so far."""
        return {
            "received": self._received,
            "refused": self._refused,
            "sent": self._outgoing.sent,
            "dropped": self._outgoing.dropped,
        }

    # Connections ----------------------------------------------------------------------------------

    def _read(self) -> Sequence[Arrival] | None:
        """Take one message, or one connection; None if there is neither."""
        self._has_asked = False
        for descriptor, _ in self._poll.poll(0, 1):
            connection = self._connections.get(descriptor)
            if connection is None:
                self._accept()
                return ()
            return self._take(connection)
        return None

    def _accept(self) -> None:
        try:
            accepted, _ = self._file.socket.accept()
        except OSError as error:
            if error.errno in _NO_DESCRIPTOR:  # or every wait would end at once
                self._poll.unregister(self._file.socket)
                self._is_full = True
            return
        try:
            connection = Connection(accepted)
        except OSError:
            accepted.close()
            return
        is_full = len(self._connections) >= (MOST if connection.may_drive else MOST_OF_OTHERS)
        if is_full:
            connection.close()
            return
        if self not in self._hooks:
            self._hooks.append(self)
        self._connections[connection.fileno()] = connection
        self._poll.register(connection, select.EPOLLIN)
        self._take_early(connection)
        self._outgoing.send(connection, GREETING)
        self._outgoing.sent -= 1

    def _take_early(self, connection: Connection) -> None:
        """Obey what was said before the connection was taken as far as its age does not count."""
        with suppress(OSError):
            for _ in range(AT_ONCE):
                content, _ = connection.receive(LONGEST + 1)
                if not content:
                    return
                with suppress(Refusal):
                    said = understood(content)
                    if said == Ask("disarm", {}) and connection.may_drive:
                        self.desk.take(said, 0, lambda _: None)

    def _take(self, connection: Connection) -> Sequence[Arrival]:
        """Return what a message puts into the model; it is obeyed and answered."""
        try:
            content, age = connection.receive(LONGEST + 1)
        except BlockingIOError:
            return ()
        except OSError:
            content, age = b"", 0
        if not content:
            self._part_with(connection)
            return ()
        self._received += 1
        try:
            return self._obey(understood(content), age, connection)
        except Refusal as why:
            self._refused += 1
            self._outgoing.answer(connection, error=str(why))
            return ()

    def _part_with(self, connection: Connection) -> None:
        """Forget a process that has gone."""
        del self._connections[connection.fileno()]
        self._poll.unregister(connection)
        self._outgoing.forget(connection)
        connection.close()
        if self._is_full:
            self._poll.register(self._file.socket, select.EPOLLIN)
            self._is_full = False

    # What is asked --------------------------------------------------------------------------------

    def _obey(
        self, said: Ask | Put | Watch | List | Time, age: int, connection: Connection
    ) -> Sequence[Arrival]:
        """Raises Refusal."""
        if isinstance(said, Put):
            _refuse_outdated(said.port, age)
            arrival = self._ports.arrival(said.port, said.value)
            if said.confirm:
                self._outgoing.answer(connection, taken=said.port)
            return (arrival,)
        if isinstance(said, Ask):
            self._ask(said, age, connection)
        elif isinstance(said, Watch):
            self._outgoing.watch(connection, said)
        elif isinstance(said, Time):
            self._outgoing.answer(connection, t_ns=self._run_now(), monotonic_ns=monotonic_ns())
        else:
            self._outgoing.answer(connection, ports=self._listing, counts=self.counts())
        return ()

    def _ask(self, said: Ask, age: int, connection: Connection) -> None:
        """Answer a request, if its sender may make one."""
        self._has_asked = True

        def reply(answer: Answer) -> None:
            self._outgoing.send(connection, message_of(**answer))

        if connection.may_drive:
            self.desk.take(said, age, reply)
            return
        who = f"process {connection.by.process} is user {connection.by.user}'s"
        reply({"refused": [f"{who}; expected the user of that run, or root"]})


def _refuse_outdated(name: str, age: int) -> None:
    """Refuse a value that a run which stood still finds when it goes on. Raises Refusal."""
    if age > TIMEOUT:
        raise Refusal(
            f"sent {age / SECOND:.1f} s before it was read",
            where=name,
            expected=f"a value that has not waited for more than {TIMEOUT // SECOND} s",
        )
