"""Doubles on a Unix socket, in real time, for as many clients as come.

One loop, no thread. It wakes when a packet arrives, and when an output changes by itself, so that
the log has every change as it happens; and with a client connected every few milliseconds, so that
no question has to wait for the samples that a sensor took in a long silence. Between two wakings
the doubles' time goes on only by what a transaction takes on the wire.

A path is taken if it is free or its last owner is dead, and given back. A client that goes takes
nothing with it; one that does not take its answers is sent away. A bug in a double ends the server
with its traceback.
"""

from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from selectors import EVENT_READ, DefaultSelector
from socket import AF_UNIX, SOCK_SEQPACKET, socket
from time import monotonic_ns
from typing import NamedTuple

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.hal.peer import peer_of
from firmware_runtime.hal.served.connection import lock_of
from firmware_runtime.hal.served.packets import LONGEST
from firmware_runtime.system.resources import Closing, WakeUp
from sim_doubles.served.logs import EventLog, ServingError
from sim_doubles.served.service import Service

LONGEST_WAIT = 10 * MILLISECOND
LONGEST_WAIT_ALONE = SECOND


class RealClock(WorldClock):
    """CLOCK_MONOTONIC since construction, as it was when it was last read.

    A transaction is answered at once, but for the doubles it takes its time on the wire: their time
    runs ahead by that, no further than FURTHEST_AHEAD, and real time catches up while the bus
    rests.
    """

    def __init__(self) -> None:
        super().__init__()
        self.started_at = monotonic_ns()
        self.begin(0, 0)

    def look(self) -> int:
        """Read the clock; return the present instant."""
        at = monotonic_ns() - self.started_at
        self.begin(at, at)
        return self()


class _Client(NamedTuple):
    number: int
    connection: socket


class DoublesServer(Closing):
    """Listens at a path from construction on; a context manager that takes the path away again.

    `service` and `log` live on `clock`. Raises ServingError if the path cannot be had.
    """

    def __init__(self, path: Path, service: Service, log: EventLog, clock: RealClock) -> None:
        self._service = service
        self._log = log
        self._clock = clock
        self._accepted = 0
        self._stopped = False
        self._packet = memoryview(bytearray(LONGEST))
        self._clients: set[_Client] = set()
        self._listener = listen(path)
        self._wake_up = WakeUp()
        self._selector = DefaultSelector()
        self._selector.register(self._listener, EVENT_READ, self._accept)
        self._selector.register(self._wake_up, EVENT_READ, self._end)
        self._resources = ExitStack()
        self._resources.enter_context(self._selector)
        self._resources.enter_context(self._wake_up)
        self._resources.callback(unlisten, self._listener, path)

    def serve(self, alone_for: int = NEVER) -> None:
        """Serve until `stop`, or until there was no client for `alone_for` ns."""
        last_client_at = self._clock()
        while not self._stopped:
            self.step()
            if self._clients:
                last_client_at = self._clock()
            elif self._clock() - last_client_at >= alone_for:
                return

    def step(self) -> None:
        """Wait until there is something to do, a little while at most; do it."""
        now = self._clock.look()
        longest = LONGEST_WAIT if self._clients else LONGEST_WAIT_ALONE
        wait = min(self._service.catch_up() - now, longest)
        for key, _ in self._selector.select(wait / SECOND):
            self._clock.look()
            key.data()

    def watch(self, connection: socket, serve: Callable[[], None]) -> None:
        """Call `serve` whenever something has arrived at a connection that is not a client's."""
        self._selector.register(connection, EVENT_READ, serve)

    def stop(self) -> None:
        """End `serve`; safe in a signal handler."""
        self._wake_up.ring()

    def close(self) -> None:
        """Send the clients away and take the path away."""
        for client in self._clients:
            client.connection.close()
        self._resources.close()

    # What wakes it ------------------------------------------------------------------------------

    def _end(self) -> None:
        self._stopped = True

    def _accept(self) -> None:
        connection, _ = self._listener.accept()
        connection.setblocking(False)
        self._accepted += 1
        client = _Client(self._accepted, connection)
        self._clients.add(client)
        self._selector.register(connection, EVENT_READ, partial(self._serve, client))
        pid = peer_of(connection).process
        self._log.event(self._clock(), "connected", client=client.number, pid=pid)

    def _serve(self, client: _Client) -> None:
        """Answer one packet; a client that sent none has gone."""
        packet = self._received(client)
        if not packet or not _send(client, self._service.answer(packet, client.number)):
            self._dismiss(client)

    def _received(self, client: _Client) -> memoryview:
        try:
            length = client.connection.recv_into(self._packet)
        except OSError:
            length = 0
        return self._packet[:length]

    def _dismiss(self, client: _Client) -> None:
        self._service.release(client.number)
        self._log.event(self._clock(), "gone", client=client.number)
        self._clients.remove(client)
        self._selector.unregister(client.connection)
        client.connection.close()


def _send(client: _Client, answer: bytes) -> bool:
    """Return whether the client takes the answer, now."""
    try:
        client.connection.send(answer)
    except OSError:
        return False
    return True


def listen(path: Path) -> socket:
    """Listen at a path.

    Raises ServingError if a living server has it, something else lies there, or the folder does
    not take it.
    """
    listener = socket(AF_UNIX, SOCK_SEQPACKET)
    try:
        if path.is_socket():
            _remove_dead(path)
        listener.bind(str(path))
        lock_of(path).touch()
        listener.listen()
    except OSError as error:
        listener.close()
        reason = error.strerror or error
        raise ServingError(f"{path}: no socket here ({reason}); expected a free path") from error
    except ServingError:
        listener.close()
        raise
    return listener


def unlisten(listener: socket, path: Path) -> None:
    """Close the listener and remove its path."""
    listener.close()
    for each in (path, lock_of(path)):
        with suppress(FileNotFoundError):
            each.unlink()


def _remove_dead(path: Path) -> None:
    """Remove a socket without a listener; refuse one that has a listener."""
    with socket(AF_UNIX, SOCK_SEQPACKET) as probe:
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
        except OSError:
            pass  # too busy to answer, or of another kind: it lives
    raise ServingError(f"{path}: another server listens here; expected a free path")
