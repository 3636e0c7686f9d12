"""Ways from a run to the other end of its link: Unix sockets that never block.

`PathChannel` leads straight to a run on this machine, by two names in the file system, so either
end may come first and come again. `CarrierChannel` leads to a process of our own that carries the
frames on; it is started here, lives as long as the pair of sockets between the two, and keeps the
network out of the run.
"""

import errno
import os
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from select import select
from typing import Final

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.wire import LONGEST
from firmware_runtime.links.local_socket import SocketFile
from firmware_runtime.system.programs import end_within

_BEGINS_WITHIN_S: Final = 30.0
"""How long a carrier may take to get its sockets."""
_LINGER: Final = 200_000
"""Us for which each of the last frames may wait for room, where the receiver is slow."""
_END_WITHIN_S: Final = 5.0
"""How long a carrier may take to end once the run has closed its socket."""


class ChannelClosed(Exception):
    """The process at the other end of a pair of sockets has ended."""


class Channel:
    """The way to the other end, as the run's loop uses it: a socket that never blocks."""

    def __init__(self, own: socket.socket) -> None:
        self._socket = own

    def fileno(self) -> int:
        """Return the descriptor that becomes readable when a frame has come."""
        return self._socket.fileno()

    def receive(self) -> bytes | None:
        """Return the next frame; None if there is none. Raises ChannelClosed."""
        try:
            return self._socket.recv(LONGEST + 1)
        except BlockingIOError:
            return None

    def frames(self, most: int) -> Iterator[bytes]:
        """Yield the frames that have come, `most` at most. Raises ChannelClosed."""
        for _ in range(most):
            if (frame := self.receive()) is None:
                return
            yield frame

    def send(self, frame: bytes) -> None:
        """Send without waiting. Raises OSError where there is no room, or no other end."""
        self._socket.send(frame)

    def linger(self) -> None:
        """From now on let `send` wait for room, 0.2 s at most: the run is over.

        In the kernel, since select says that a socket with no fixed receiver has room.
        """
        self._socket.setblocking(True)
        waits = struct.pack("ll", 0, _LINGER)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, waits)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class PathChannel(Channel):
    """Two runs on one machine: this one's socket at `own`, the other's at `other`.

    Raises ConfigError if the socket cannot be made, its folder is not there, or another process
    listens at `own` already.
    """

    def __init__(self, own: Path, other: Path) -> None:
        if not own.parent.is_dir():
            raise ConfigError.of_one(
                "--link", f"{own}: there is no folder {own.parent}", "one that is there"
            )
        if _is_taken(own):
            fault = f"{own}: another process listens there; expected it to have ended"
            raise ConfigError.of_one("--link", f"{fault}, or another path")
        self._file = SocketFile(own, 0o600, "expected another path for --link")
        super().__init__(self._file.socket)
        self._other = os.fspath(other)

    def send(self, frame: bytes) -> None:
        """Send without waiting. Raises OSError where there is no room, or no other end."""
        self._socket.sendto(frame, self._other)

    def close(self) -> None:
        """Close the socket, and remove it."""
        self._file.close()


@dataclass(frozen=True, slots=True)
class Interpreter:
    """The Python that a carrier runs in: its first words, and its variables."""

    words: Sequence[str] = (sys.executable, "-P")
    variables: Mapping[str, str] | None = None


class CarrierChannel(Channel):
    """A carrier of its own: module `carrier` of Python, with these arguments and the pair's end.

    It is started at once, at ordinary priority. It ends when the pair is closed, also by the
    kernel. Raises ConfigError with what it says, if it cannot begin.
    """

    def __init__(
        self,
        carrier: str,
        arguments: Sequence[str],
        interpreter: Interpreter = Interpreter(),
    ) -> None:
        own, theirs = socket.socketpair(
            socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK
        )
        super().__init__(own)
        own.set_inheritable(False)
        theirs.setblocking(True)
        words = [*interpreter.words, "-m", carrier, str(theirs.fileno()), *arguments]
        try:
            self.process = subprocess.Popen(  # noqa: S603 -- this project's own module
                words,
                pass_fds=[theirs.fileno()],
                env=interpreter.variables,
                stdin=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                stdout=subprocess.PIPE,
            )
        finally:
            theirs.close()
        self._begin()

    def receive(self) -> bytes | None:
        """Return the next frame; None if there is none. Raises ChannelClosed."""
        try:
            frame = super().receive()
        except OSError as error:
            raise ChannelClosed from error
        if frame == b"":
            raise ChannelClosed
        return frame

    def close(self) -> None:
        """Close the pair, and wait for the carrier to hand on what it has and to end."""
        self._socket.close()
        end_within(self.process, _END_WITHIN_S)
        for pipe in (self.process.stdout, self.process.stderr):
            if pipe is not None:
                pipe.close()

    def _begin(self) -> None:
        """Wait until it has its sockets. Raises ConfigError with its sentence if it has none."""
        assert self.process.stdout is not None  # noqa: S101 -- it is a pipe
        ready, _, _ = select([self.process.stdout], (), (), _BEGINS_WITHIN_S)
        said = self.process.stdout.readline() if ready else b""
        if said.strip() != b"ready":
            self.process.kill()
            _, failure = self.process.communicate()
            self._socket.close()
            text = failure.decode(errors="replace").strip() or "the carrier has not begun"
            raise ConfigError.of_one("--link", text.removeprefix("--link: "))


def _is_taken(path: Path) -> bool:
    """Return whether a process listens at a path, be it with a socket of another kind."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(os.fspath(path))
        except OSError as error:
            return error.errno == errno.EPROTOTYPE
    return True
