"""A run's socket that answers what a test wants, when it wants."""

import json
import socket
from pathlib import Path
from select import select
from threading import Thread

from firmware_runtime.closing import Closing
from tests.support.waiting import PATIENCE_S


class Replies(Closing):
    """Bound to a path from construction on; the path is free again when it is closed."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.settimeout(PATIENCE_S)
        self._socket.bind(str(path))
        self._thread: Thread | None = None

    def close(self) -> None:
        """Wait until what is to be answered was, and free the path."""
        self.wait()
        self._socket.close()
        self.path.unlink()

    def has_request(self) -> bool:
        """Whether one waits to be read."""
        return bool(select([self._socket], (), (), 0)[0])

    def requests(self) -> list[str]:
        """What waits to be read."""
        found = []
        while self.has_request():
            found.append(self._socket.recv(1 << 16).decode())
        return found

    def answer(self, answer: dict[str, object]) -> None:
        """Wait for a request, and answer it."""
        self.answer_bytes(json.dumps(answer).encode())

    def answer_bytes(self, answer: bytes) -> str:
        """The same with bytes that need not be JSON; the request."""
        request, sender = self._socket.recvfrom(1 << 16)
        self._socket.sendto(answer, sender)
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
