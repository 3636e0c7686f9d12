"""A run's socket, and its statistics, that answers what a test wants, when it wants."""

import json
import select
import socket
from collections import deque
from contextlib import suppress
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

from firmware_runtime.links.ports.datagrams import GREETING
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import Layout
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.system.resources import Closing
from tests.support.waiting import PATIENCE_S


def state_run(statistics: Path) -> None:
    """Keep statistics there, as a run of this process does."""
    StatisticsFile(Layout(), {"models": {}, "conditions": {}}, statistics)


class Replies(Closing):
    """Listens from construction on, and greets; the path is free again when it is closed."""

    def __init__(self, statistics: Path) -> None:
        self.path = statistics
        state_run(statistics)
        self._socket = Companion.SOCKET.beside(statistics)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._listener.bind(str(self._socket))
        self._listener.listen()
        self._end, self._ended = socket.socketpair()
        self._said: Queue[tuple[bytes, socket.socket]] = Queue()
        self._connections: list[socket.socket] = []
        self._listening = Thread(target=self._listen)
        self._listening.start()
        self._thread: Thread | None = None

    def close(self) -> None:
        """Wait until what is to be answered was, and free the path."""
        self.wait()
        if not self._listening.is_alive():
            return
        self._socket.unlink()
        self._end.send(b".")
        self._listening.join()
        for each in (self._listener, self._end, self._ended, *self._connections):
            each.close()

    def has_request(self) -> bool:
        """Whether one waits to be read."""
        return not self._said.empty()

    def taken(self) -> list[tuple[bytes, socket.socket]]:
        """What waits to be read, and the way back to who said it."""
        found: deque[tuple[bytes, socket.socket]] = deque()
        while True:
            try:
                found.append(self._said.get_nowait())
            except Empty:
                return list(found)

    def requests(self) -> list[str]:
        """What waits to be read."""
        return [said.decode() for said, _ in self.taken()]

    def next(self) -> tuple[bytes, socket.socket]:
        """Wait for a message; it, and the way back to who said it."""
        return self._said.get(timeout=PATIENCE_S)

    def answer(self, answer: dict[str, object]) -> None:
        """Wait for a request, and answer it."""
        self.answer_bytes(json.dumps(answer).encode())

    def answer_bytes(self, answer: bytes) -> str:
        """The same with bytes that need not be JSON; the request."""
        request, back = self.next()
        back.send(answer)
        return request.decode()

    def answer_in_background(self, answer: dict[str, object]) -> None:
        """The same for a request that is still to come."""
        self._thread = Thread(target=self.answer, args=(answer,))
        self._thread.start()

    def wait(self) -> None:
        """Wait until that was answered."""
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _listen(self) -> None:
        """Greet each that comes, and keep what it says."""
        open_ones = [self._listener, self._ended]
        while True:
            ready, _, _ = select.select(open_ones, (), ())
            for each in ready:
                if each is self._ended:
                    return
                if each is self._listener:
                    accepted, _ = each.accept()
                    self._connections.append(accepted)
                    open_ones.append(accepted)
                    with suppress(ConnectionError):  # it has gone already
                        accepted.send(GREETING)
                elif said := _received(each):
                    self._said.put((said, each))
                else:
                    open_ones.remove(each)


def _received(connection: socket.socket) -> bytes:
    try:
        return connection.recv(1 << 16)
    except ConnectionResetError:  # it has gone without reading all; what it said waits still
        return connection.recv(1 << 16)
