"""Enabled outputs as a value at a port: for a controller that must not act in vain.

A controller that is at work while its outputs are disabled winds up: it drives harder and harder
against what does not move. One that takes this value in begins when it is obeyed. The model belongs
to the end of a cut robot that has the hardware; name its port in `retain` of `[link]`, since it
says each thing once.
"""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.hal.interlock import POLL_PERIOD, Interlock, always_enabled


class OutputState(Atomic):
    """Sends 1 when outputs are enabled and 0 when they are not: at first, and when that changes.

    polling (0 at first, then POLL_PERIOD) --> the same, or saying (0) --enabled!--> polling
    """

    def __init__(self, name: str, interlock: Interlock = always_enabled) -> None:
        super().__init__(name)
        self.enabled = self.out_port("enabled", int)
        self.interlock = interlock
        self.is_enabled: bool | None = None
        """As it was sent last; None before."""

    def initialize(self) -> None:
        """Look at once."""
        self.activate("polling")

    def output(self) -> None:
        """Send how it is, where that is new."""
        if self.phase == "saying":
            self.enabled.send(int(self.is_enabled is True))

    def internal(self) -> None:
        """Check again soon."""
        if self.phase == "polling" and (found := self.interlock()) is not self.is_enabled:
            self.is_enabled = found
            self.activate("saying")
        else:
            self.hold_in("polling", POLL_PERIOD)
