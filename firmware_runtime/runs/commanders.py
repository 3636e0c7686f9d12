"""Whether the processes that command a robot still do: outputs are off while one has fallen silent.

    nothing came yet --value--> heard --no other for its timeout--> silent --value--> heard

A port at which nothing has come yet commands nothing. While one is silent the run is disarmed, and
it is armed again once values come, by the terms of any other arming. An end without hardware drives
nothing itself: it falls silent to the other end, whose own timeout then switches off.
"""

from collections.abc import Callable, Mapping
from typing import Any

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.executive.executive import Executive


class Commanders:
    """A hook of the run, for input ports that have a timeout, ns.

    `on_silence` is called with a sentence when one falls silent.
    """

    def __init__(
        self,
        executive: Executive,
        timeouts: Mapping[InPort[Any], int],
        on_silence: Callable[[str], None],
    ) -> None:
        self._executive = executive
        self._timeouts = {port.name: timeout for port, timeout in timeouts.items()}
        self._on_silence = on_silence
        self._silent_at: dict[str, int] = {}
        self._is_silent = False
        for port in timeouts:
            executive.simulator.listen(port, self._listener(port.name))
        executive.hooks.append(self)

    def why_silent(self, now: int) -> str | None:
        """Pre-arm check: which port has had no value for too long; None if all that had any do."""
        for name, at in self._silent_at.items():
            if now >= at:
                return f"no value has come at input {name} for {self._timeouts[name] / SECOND:g} s"
        return None

    def between_steps(self, now: int, _left: int) -> None:
        """Notice a silence as soon as it is one."""
        why, was_silent = self.why_silent(now), self._is_silent
        self._is_silent = why is not None
        if why is not None and not was_silent:
            self._on_silence(why)
        next_at = min((at for at in self._silent_at.values() if at > now), default=NEVER)
        self._executive.poll_by(next_at)

    def _listener(self, name: str) -> Callable[[int, object], None]:
        timeout = self._timeouts[name]

        def hear(at: int, _value: object) -> None:
            self._silent_at[name] = at + timeout

        return hear
