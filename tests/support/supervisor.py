"""What systemd does for a service of Type=notify with a watchdog, as far as the tests need it."""

from pathlib import Path
from socket import AF_UNIX, SOCK_DGRAM, socket
from time import monotonic_ns


class Supervisor:
    """Listens where NOTIFY_SOCKET says and waits until no sign of life comes any more."""

    def __init__(self, path: Path, watchdog_ns: int) -> None:
        self.environment = {"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": str(watchdog_ns // 1000)}
        self._watchdog_ns = watchdog_ns
        self._socket = socket(AF_UNIX, SOCK_DGRAM)
        self._socket.bind(str(path))

    def wait_for_the_watchdog(self) -> None:
        """Return when no `WATCHDOG=1` has come for the time of the watchdog."""
        self._take_what_waits()
        expires_at = monotonic_ns() + self._watchdog_ns
        while (left := expires_at - monotonic_ns()) > 0:
            self._socket.settimeout(left / 1e9)
            try:
                said = self._socket.recv(65536)
            except TimeoutError:
                return
            if b"WATCHDOG=1" in said.splitlines():
                expires_at = monotonic_ns() + self._watchdog_ns

    def close(self) -> None:
        """Stop listening."""
        self._socket.close()

    def _take_what_waits(self) -> None:
        """What was said before is no sign of life now; some of it must have been one."""
        self._socket.setblocking(False)
        said = []
        try:
            while True:
                said.append(self._socket.recv(65536))
        except BlockingIOError:
            assert any(b"WATCHDOG=1" in each.splitlines() for each in said)
