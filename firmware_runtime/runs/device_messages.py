"""Sentences on devices that stop working during a run, and work again: a hook of the loop.

    works --(does not for FAILED_AFTER)--> said --works--> said, with the time in between

A sample missed now and then is no sentence, and a device that fails again and again is one every
AGAIN_AFTER. One that never came up is for the end of the run to judge (`executive.outcome`).
"""

from collections.abc import Callable

from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.outcome import Device

LOOK_EVERY = 100 * MILLISECOND
FAILED_AFTER = 200 * MILLISECOND
"""Ns for which a device must not have worked."""
AGAIN_AFTER = 10 * SECOND
"""Ns from one sentence on a device that fails to the next."""


class DeviceMessages:
    """Watches all devices of a run; `log` gets the sentences."""

    def __init__(self, executive: Executive, log: Callable[[str], None]) -> None:
        self._log = log
        self._look_at = 0
        self._watched = [
            _Watched(below_root(atomic.path), atomic, executive.faults)
            for atomic in executive.simulator.atomics
            if isinstance(atomic, Device)
        ]
        if self._watched:
            executive.hooks.append(self)

    def between_steps(self, now: int, _left: int) -> None:
        """Ask the devices, if it is time to."""
        if now < self._look_at or now == NEVER:
            return
        self._look_at = now + LOOK_EVERY
        for watched in self._watched:
            if (sentence := watched.news(now)) is not None:
                self._log(sentence)


class _Watched:
    """One device, and what was said of it."""

    def __init__(self, path: str, device: Device, faults: FaultLog) -> None:
        self._path = path
        self._device = device
        self._faults = faults
        self._has_worked = False
        self._fails_since = NEVER
        """When it was first seen not to work, after it had; NEVER while it works."""
        self._is_said = False
        self._again_at = 0

    def news(self, now: int) -> str | None:
        """Return a sentence on what has become of it, if that is to be said now."""
        why = self._device.unready()
        if why is None:
            return self._working(now)
        if self._has_worked and self._fails_since == NEVER:
            self._fails_since = now
        lasts = now - self._fails_since >= FAILED_AFTER
        if self._is_said or not lasts or now < self._again_at:
            return None
        self._is_said, self._again_at = True, now + AGAIN_AFTER
        last = self._faults.last_of(self._path)
        return f"{self._path} {why}" if last is None else f"{self._path} {why}: {last.sentence}"

    def _working(self, now: int) -> str | None:
        since, was_said = self._fails_since, self._is_said
        self._has_worked, self._fails_since, self._is_said = True, NEVER, False
        if not was_said:
            return None
        return f"{self._path} works again, after {(now - since) / SECOND:.1f} s"
