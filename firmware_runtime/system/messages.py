"""Messages to people, the journal and systemd, sent without waiting for a reader.

A full pipe, a terminal stopped by Ctrl-S and a journal that hangs all make a plain `print` wait.
The stream is shared with other processes, a shell's terminal with all that run in it, so its
O_NONBLOCK flag is left as it is. Instead

- a socket, such as the journal's, is sent to with MSG_DONTWAIT;
- a pipe or a terminal is opened once more, through /proc/self/fd, without blocking; where that is
  refused, it is written to only while poll(2) reports room, and no more than fits then;
- a file is written to.

What does not fit is dropped and counted. The next sentence that fits is preceded by the count.

Sources: systemd's native journal protocol; sd_notify(3), sd_watchdog_enabled(3).
"""

import os
import stat
import struct
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from select import PIPE_BUF, POLLOUT, poll
from time import monotonic_ns
from typing import TYPE_CHECKING, Final, Self, TextIO, TypeAlias

from firmware_runtime.devs.time import MICROSECOND, NEVER

if TYPE_CHECKING:
    import socket

    from sdnotify import SystemdNotifier

_Write: TypeAlias = Callable[[bytes], int]
"""Writes without waiting; returns how many bytes were taken, or raises OSError."""


class Sentences:
    """Prints to one stream, never waits and never fails. Not for several threads.

    A stream without a descriptor, such as one in memory, is written to as usual.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self.dropped = 0
        """Sentences that found no room, since the last that did."""
        self._rest = b""
        self._opened = ExitStack()
        self._write = self._nowhere if stream is None else self._writer(stream)

    def say(self, sentence: str) -> None:
        """Print a line, or drop it."""
        line = f"{sentence}\n"
        if self.dropped:
            line = f"({self.dropped} dropped: no room for them)\n{line}"
        if self._is_begun(line.encode(errors="backslashreplace")):
            self.dropped = 0
        else:
            self.dropped += 1

    def close(self) -> None:
        """Release what was opened; what is printed afterwards is dropped."""
        self._write = self._nowhere
        self._opened.close()

    def _is_begun(self, line: bytes) -> bool:
        """Write as much as fits; a line that was begun goes on before the next one."""
        data = self._rest + line
        written = 0
        with suppress(OSError, ValueError):  # no room, no reader, a full disk, a closed stream
            written = self._write(data)
        begun = written > len(self._rest)
        self._rest = data[written:] if begun else self._rest[written:]
        return begun

    def _writer(self, stream: TextIO) -> _Write:
        """Return what writes to this kind of stream without waiting."""
        try:
            descriptor = stream.fileno()
            mode = os.fstat(descriptor).st_mode
        except (OSError, ValueError):
            return lambda data: _write_text(stream, data)
        if stat.S_ISSOCK(mode):
            import socket  # noqa: PLC0415 -- takes longer to load than all of this

            end = self._opened.enter_context(socket.socket(fileno=os.dup(descriptor)))
            return lambda data: end.send(data, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        if stat.S_ISREG(mode):
            return lambda data: os.write(descriptor, data)
        flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
        with suppress(OSError):
            own = os.open(f"/proc/self/fd/{descriptor}", flags)
            self._opened.callback(os.close, own)
            return lambda data: os.write(own, data)
        return lambda data: _write_what_fits(descriptor, data)

    @staticmethod
    def _nowhere(_data: bytes) -> int:
        return 0


def _write_text(stream: TextIO, data: bytes) -> int:
    stream.write(data.decode())
    stream.flush()
    return len(data)


def _write_what_fits(descriptor: int, data: bytes) -> int:
    room = poll()
    room.register(descriptor, POLLOUT)
    if not any(event & POLLOUT for _, event in room.poll(0)):
        return 0
    return os.write(descriptor, data[:PIPE_BUF])


SOCKET: Final = Path("/run/systemd/journal/socket")
NOTICE, WARNING = 5, 4
IDENTIFIER: Final = "firmware-runtime"


class Journal:
    """Entries for systemd's journal, with fields of their own; none where no journal listens."""

    def __init__(self, path: Path | None) -> None:
        self.dropped = 0
        self._socket: socket.socket | None = None
        if path is not None:
            with suppress(OSError):  # it has ended: a robot runs without
                self._socket = _connected(path)

    @classmethod
    def from_environment(cls) -> Self:
        """The journal, if systemd started this process with its output going there."""
        return cls(SOCKET if "JOURNAL_STREAM" in os.environ and SOCKET.exists() else None)

    @property
    def is_there(self) -> bool:
        """True if there is a journal to write to."""
        return self._socket is not None

    def write(self, message: str, priority: int = NOTICE, **fields: object) -> None:
        """Write one entry; fields have names in capitals."""
        if self._socket is None:
            return
        named = {"MESSAGE": message, "PRIORITY": priority, "SYSLOG_IDENTIFIER": IDENTIFIER}
        entry = b"".join(encoded(name, str(each)) for name, each in (named | fields).items())
        try:
            self._socket.send(entry)
        except OSError:
            self.dropped += 1

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _connected(path: Path) -> "socket.socket":
    import socket  # noqa: PLC0415 -- of a service only

    connected = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
    try:
        connected.connect(os.fspath(path))
    except OSError:
        connected.close()
        raise
    return connected


def encoded(name: str, value: str) -> bytes:
    """One field: in a line, or with its length where it has several."""
    data = value.encode(errors="backslashreplace")
    if "\n" not in value:
        return name.encode() + b"=" + data + b"\n"
    return name.encode() + b"\n" + struct.pack("<Q", len(data)) + data + b"\n"


class Notices:
    """Notices of a service to systemd; `watchdog` is the time in which it must be `alive`, in ns.

    A manager that is too busy to read does not hold up the loop. Ready and alive are sent again
    until there is room; anything else is lost then.
    """

    def __init__(self, watchdog: int = NEVER) -> None:
        self._notifier = _notifier()
        self._every = watchdog if watchdog == NEVER else watchdog // 4
        self._last_alive = 0
        self._is_ready_owed = False

    @classmethod
    def from_environment(cls) -> Self:
        """As systemd has it: NOTIFY_SOCKET, and WATCHDOG_USEC if this process is meant."""
        return cls(watchdog_of(os.environ))

    @property
    def is_there(self) -> bool:
        """True if the service manager gave us a socket."""
        return self._notifier is not None

    def close(self) -> None:
        """Close the socket."""
        if self._notifier is not None:
            self._notifier.socket.close()
            self._notifier = None

    def ready(self) -> None:
        """The service works from now on."""
        self._is_ready_owed = not self._notify("READY=1")

    def progress(self, what: str, within: int) -> None:
        """The start goes on, with this stage, and takes no longer than `within` ns from now."""
        self._notify(f"EXTEND_TIMEOUT_USEC={within // MICROSECOND}\nSTATUS={what}")

    def reloading(self) -> None:
        """Settings are read again; `ready` ends it."""
        self._notify(f"RELOADING=1\nMONOTONIC_USEC={monotonic_ns() // MICROSECOND}")

    def stopping(self) -> None:
        """The service is about to end."""
        self._notify("STOPPING=1")

    def status(self, what: str) -> None:
        """One line for `systemctl status`."""
        self._notify(f"STATUS={what}")

    def alive(self) -> None:
        """Feed the watchdog, four times as often as it must be; called again and again."""
        if self._is_ready_owed:
            self.ready()
        now = monotonic_ns()
        is_due = self._every != NEVER and now - self._last_alive >= self._every
        if is_due and self._notify("WATCHDOG=1"):
            self._last_alive = now

    def _notify(self, state: str) -> bool:
        if self._notifier is None:
            return True
        try:
            sent = state.encode(errors="backslashreplace")
            self._notifier.notify(sent.decode("latin-1"))  # which it is encoded by
        except OSError:
            return False
        return True


def _notifier() -> "SystemdNotifier | None":
    """Return where NOTIFY_SOCKET leads, if anywhere."""
    if not os.environ.get("NOTIFY_SOCKET"):
        return None
    from sdnotify import SystemdNotifier  # noqa: PLC0415 -- of a service only

    notifier = SystemdNotifier()
    if notifier.socket is None:
        return None
    notifier.socket.setblocking(False)
    notifier.debug = True  # raises when a notice was not delivered
    return notifier


def watchdog_of(environment: Mapping[str, str]) -> int:
    """The watchdog's time in ns; NEVER where there is none for this process."""
    stated = environment.get("WATCHDOG_USEC", "")
    pid = environment.get("WATCHDOG_PID", str(os.getpid()))
    if not stated.isdigit() or pid != str(os.getpid()):
        return NEVER
    return int(stated) * MICROSECOND
