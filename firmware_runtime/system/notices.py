"""Notices to systemd: ready, alive, and a line of status; none where systemd does not listen.

They never wait: a manager that is too busy to read must not hold up the loop. That a service is
ready or alive is said until there is room for it; anything else is lost then.

Source: sd_notify(3), sd_watchdog_enabled(3).
"""

import os
from collections.abc import Mapping
from time import monotonic_ns
from typing import TYPE_CHECKING, Self

from firmware_runtime.devs.time import MICROSECOND, NEVER

if TYPE_CHECKING:
    from sdnotify import SystemdNotifier


class Notices:
    """A service's notices to its manager. `watchdog` is the time in which it must be `alive`."""

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
        """Whether the service manager gave us a socket."""
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
            self._notifier.notify(state.encode().decode("latin-1"))  # which it is encoded by
        except OSError:
            return False
        return True


def _notifier() -> "SystemdNotifier | None":
    """Where NOTIFY_SOCKET leads, if anywhere."""
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
