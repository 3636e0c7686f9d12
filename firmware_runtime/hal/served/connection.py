"""A client's connection to served doubles: questions out, answers in, every wait bounded."""

import threading
import weakref
from fcntl import LOCK_EX, LOCK_NB, flock
from pathlib import Path
from socket import AF_UNIX, SOCK_SEQPACKET, socket
from typing import BinaryIO, Final

from msgspec import MsgspecError

from firmware_runtime.hal.peer import peer_of, trusted_users
from firmware_runtime.hal.served.packets import (
    LONGEST,
    Answered,
    Asked,
    Question,
    encode,
    read_answer,
)
from firmware_runtime.hal.wire_errors import BusAbsent, BusFault, BusInUse, BusTimeout
from firmware_runtime.system.resources import tried_again

ANSWER_S: Final = 1.0
"""How long an answer may take; doubles need less than a millisecond, a busy machine more."""


def lock_of(path: Path) -> Path:
    """The file that a process which drives the doubles at a path holds locked."""
    return path.with_name(f"{path.name}.lock")


class Connection:
    """A connection to the server at a path, one question at a time, from any thread.

    A server that has gone is not connected to again: another would have other chips. One that is
    about to listen is waited for, `wait_s` at most. Raises BusAbsent if no doubles are served.
    """

    def __init__(self, path: Path, answer_s: float = ANSWER_S, *, wait_s: float = 0.0) -> None:
        self._path = path
        self._answer_s = answer_s
        self._number = 0
        self._packet = memoryview(bytearray(LONGEST))
        self._lock = threading.Lock()
        self._lock_file: BinaryIO | None = None
        self._socket = _connected(path, answer_s, wait_s)
        weakref.finalize(self, self._socket.close)

    def keep_others_out(self) -> None:
        """Drive the doubles alone, until this process ends or closes the connection.

        A lock on a file, as on a bus's device node: a process that does not ask for it is not kept
        out. Raises BusInUse if another process has it, BusAbsent if this user may not even read
        the file.
        """
        self._lock_file = self._opened_lock()
        try:
            flock(self._lock_file, LOCK_EX | LOCK_NB)
        except BlockingIOError as error:
            self.close()
            raise BusInUse(
                "these doubles are driven by another process, expected none; end that one",
                where=self._path,
            ) from error

    def ask(self, asked: Asked, where: str) -> Answered:
        """Ask, and wait for the answer; `where` is what an error's sentence begins with.

        Raises BusTimeout without an answer in time, then the server may still carry it out;
        BusAbsent when it has gone, BusFault when what answers is no server of doubles.
        """
        with self._lock:
            self._number += 1
            try:
                self._socket.send(encode(Question(self._number, asked)))
                return self._answer()
            except TimeoutError as error:
                raise BusTimeout(
                    f"no answer from the doubles at {self._path}",
                    where=where,
                    expected=f"one within {self._answer_s:g} s",
                ) from error
            except OSError as error:
                raise BusAbsent(
                    f"the doubles at {self._path} have gone",
                    where=where,
                    expected="them to be served",
                ) from error
            except (MsgspecError, UnicodeDecodeError, RecursionError) as error:
                raise BusFault(
                    f"{self._path} answered with no answer ({error})",
                    where=where,
                    expected="doubles",
                ) from error

    def close(self) -> None:
        """Leave the server; it notices. Others may drive the doubles."""
        self._socket.close()
        if self._lock_file is not None:
            self._lock_file.close()

    def _opened_lock(self) -> BinaryIO:
        """The file to lock, which the server made: it may be another user's, so it is only read.

        Raises BusAbsent.
        """
        path = lock_of(self._path)
        try:
            if not path.exists():
                path.touch()
            return path.open("rb")
        except OSError as error:
            self.close()
            raise BusAbsent(
                f"cannot be locked ({error.strerror})",
                where=path,
                expected="doubles that this user may drive",
            ) from error

    def _answer(self) -> Answered:
        """The answer to the last question; those that came too late are dropped."""
        while length := self._socket.recv_into(self._packet):
            answer = read_answer(self._packet[:length])
            if answer.number in {0, self._number}:
                return answer.answered
        raise ConnectionResetError("end of the stream")


def _connected(path: Path, answer_s: float, wait_s: float) -> socket:
    """A socket that is connected to the server at a path. Raises BusAbsent."""
    not_yet = FileNotFoundError, ConnectionRefusedError
    try:
        connection = tried_again(lambda: _connected_at_once(path, answer_s), not_yet, wait_s)
    except OSError as error:
        raise BusAbsent(
            f"no doubles are served here ({error.strerror or error})",
            where=path,
            expected=f"`firmware-runtime doubles serve BOARD --socket {path}` to run",
        ) from error
    if (user := peer_of(connection).user) not in trusted_users(path.parent):
        connection.close()
        raise BusAbsent(
            f"user {user} serves here, and so may anybody",
            where=path,
            expected="doubles of root, of this user, or of the user to whom the folder belongs",
        )
    return connection


def _connected_at_once(path: Path, answer_s: float) -> socket:
    connection = socket(AF_UNIX, SOCK_SEQPACKET)
    connection.settimeout(answer_s)
    try:
        connection.connect(str(path))
    except OSError:
        connection.close()
        raise
    return connection
