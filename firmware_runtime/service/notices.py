"""Notices to systemd: ready, alive, in a word how it goes; silent where nobody listens.

Source: sd_notify(3), sd_watchdog_enabled(3).
"""

import os
from collections.abc import Mapping
from time import monotonic_ns
from typing import Self

from sdnotify import SystemdNotifier

from firmware_runtime.devs.time import MICROSECOND, NEVER


class Notices:
    """What a service tells its manager. `watchdog` is the time within which it must be `alive`."""

    def __init__(self, watchdog: int = NEVER) -> None:
        self._notifier = SystemdNotifier() if "NOTIFY_SOCKET" in os.environ else None
        self._every = watchdog if watchdog == NEVER else watchdog // 4
        self._last_alive = 0

    @classmethod
    def from_environment(cls) -> Self:
        """As systemd has it: NOTIFY_SOCKET, and WATCHDOG_USEC if this process is meant."""
        return cls(watchdog_of(os.environ))

    @property
    def is_there(self) -> bool:
        """Whether somebody listens."""
        return self._notifier is not None

    def close(self) -> None:
        """Tell nobody anything any more."""
        if self._notifier is not None:
            self._notifier.socket.close()
            self._notifier = None

    def ready(self) -> None:
        """The service works from now on."""
        self._notify("READY=1")

    def reloading(self) -> None:
        """Settings are read again; `ready` says that it is over."""
        self._notify(f"RELOADING=1\nMONOTONIC_USEC={monotonic_ns() // MICROSECOND}")

    def stopping(self) -> None:
        """The service is about to end."""
        self._notify("STOPPING=1")

    def status(self, what: str) -> None:
        """One line for `systemctl status`."""
        self._notify(f"STATUS={what}")

    def alive(self) -> None:
        """Feed the watchdog, four times as often as it must be."""
        now = monotonic_ns()
        if self._every != NEVER and now - self._last_alive >= self._every:
            self._last_alive = now
            self._notify("WATCHDOG=1")

    def _notify(self, state: str) -> None:
        if self._notifier is not None:
            self._notifier.notify(state)


def watchdog_of(environment: Mapping[str, str]) -> int:
    """The watchdog's time in ns; NEVER where there is none for this process."""
    stated = environment.get("WATCHDOG_USEC", "")
    pid = environment.get("WATCHDOG_PID", str(os.getpid()))
    if not stated.isdigit() or pid != str(os.getpid()):
        return NEVER
    return int(stated) * MICROSECOND
