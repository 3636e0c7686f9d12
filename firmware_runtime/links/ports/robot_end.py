"""The other end of a run's socket: how a process of its own speaks with a running robot."""

import select
import socket
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from errno import EBADF, ECONNREFUSED
from pathlib import Path
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.hal.peer import Credentials, peer_of, trusted_users
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.links.ports.datagrams import GREETING
from firmware_runtime.statistics.file_header import STATISTICS, driver_of
from firmware_runtime.statistics.paths import Companion

AT_ONCE: Final = 64
"""How many messages are taken in a row."""
ROOM: Final = 16
"""How many messages wait for the run to take the connection."""
WAITS_FOR: Final = SECOND // 4
"""Ns for which they do: a value that is older is not sent."""
_LONGEST: Final = 1 << 18


class NoAnswer(HalError, TimeoutError):
    """Nothing that can be believed was answered in time."""


class RobotEnd:
    """Speaks with whatever run keeps its statistics at a path: with this one, and the next.

    What listens beside the statistics is believed once it has greeted, if it is the process that
    they name. Nothing waits. Raises OSError if there is no descriptor left for it.
    """

    def __init__(self, statistics: Path) -> None:
        self.path = Companion.SOCKET.beside(statistics)
        self.why_not_believed = ""
        """What is wrong with the process that listens; empty if nothing is."""
        self.is_greeted = False
        self._statistics = statistics
        self._socket: socket.socket | None = None
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._poll = select.epoll()

    def fileno(self) -> int:
        """The descriptor that becomes readable when the robot has said something."""
        return self._poll.fileno()

    @property
    def is_connected(self) -> bool:
        """Return whether a run, or what takes its place, listens and has not gone."""
        return self._socket is not None

    def why_absent(self) -> str:
        """Return why there is no run to speak with, empty if there is one; connects to it."""
        try:
            self.connect()
        except OSError as error:
            return error.strerror or str(error)
        return self.why_not_believed

    def connect(self) -> None:
        """Connect to the run, unless that is done. Raises OSError if none listens."""
        if self._socket is not None:
            return
        if self._poll.closed:
            raise OSError(EBADF, "this end is closed")
        made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK)
        try:
            made.connect(str(self.path))
        except OSError:
            made.close()
            raise
        self._poll.register(made, select.EPOLLIN)
        self._socket = made

    def send(self, message: bytes) -> None:
        """Say something, without waiting; it leaves when the run has greeted.

        Raises BlockingIOError if there is no room for it, another OSError if no run listens.
        """
        self.connect()
        if not self.is_greeted:
            if len(self._waiting) >= ROOM:
                raise BlockingIOError
            self._waiting.append((monotonic_ns(), message))
            return
        assert self._socket is not None  # noqa: S101 -- it is connected
        try:
            self._socket.send(message)
        except BlockingIOError:
            raise
        except OSError:  # that run has gone: there may be another
            self._disconnect()
            self.connect()
            self._waiting.append((monotonic_ns(), message))

    def received(self) -> Iterator[bytes]:
        """Yield what the robot has said, without waiting."""
        for _ in range(AT_ONCE):
            if self._socket is None:
                return
            try:
                said = self._socket.recv(_LONGEST)
            except BlockingIOError:
                return
            except OSError:
                said = b""
            if not said:
                self._disconnect()
            elif self.is_greeted:
                yield said
            else:
                self._believe(said)

    def forget(self) -> None:
        """Connect again before the next is sent: this run has not answered."""
        self._disconnect()

    def close(self) -> None:
        """Close the socket."""
        self._disconnect()
        self._poll.close()

    def _believe(self, greeting: bytes) -> None:
        """Let what waits leave, to the run that the statistics name and to no other process."""
        assert self._socket is not None  # noqa: S101 -- it has said something
        if greeting == GREETING:
            self.why_not_believed = why_not_of_run(peer_of(self._socket), self._statistics)
        else:
            self.why_not_believed = "greets as no run does"
        if self.why_not_believed:
            self._disconnect()
            return
        self.is_greeted = True
        oldest = monotonic_ns() - WAITS_FOR
        with suppress(OSError):
            while self._waiting:
                at, message = self._waiting.popleft()
                if at >= oldest:
                    self._socket.send(message)

    def _disconnect(self) -> None:
        self.is_greeted = False
        self._waiting.clear()
        if self._socket is not None:
            self._poll.unregister(self._socket)
            self._socket.close()
            self._socket = None


class OneRunsEnd(RobotEnd):
    """The same with one run: the first that it connects to, and none that comes after it."""

    _had_one = False

    def connect(self) -> None:
        """Raises ConnectionRefusedError once that run has gone, otherwise as `RobotEnd`."""
        if self._socket is None and self._had_one:
            raise ConnectionRefusedError(ECONNREFUSED, "the run that was spoken with has gone")
        super().connect()
        self._had_one = True


def why_not_of_run(by: Credentials, statistics: Path) -> str:
    """Return why a process does not speak for the run with these statistics, empty if it does.

    What listens beside the statistics may be anything where others can write to the folder, and a
    run that hangs cannot object. So the process has to be the one that writes the statistics; its
    user, like theirs, is root, this user or the one to whom the folder belongs, as that of a
    service does.
    """
    try:
        owner, trusted = statistics.stat().st_uid, trusted_users(statistics.parent)
        with STATISTICS.opened(statistics) as file:
            process = driver_of(file).writer.pid
    except (OSError, StatisticsFileError) as error:
        return f"process {by.process} listens, and no statistics name it ({error})"
    if owner not in trusted:
        return f"{statistics} belongs to user {owner}, and so may be anybody's"
    if by.process != process:
        return f"process {by.process} listens, and the run is process {process}"
    if by.user not in trusted:
        return f"process {by.process} is user {by.user}'s, and so may be anybody's"
    return ""
