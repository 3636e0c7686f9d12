"""Whether the robot can balance: it is upright, its outputs are enabled, its pitch is believed."""

from firmware_runtime.devs.atomic import Atomic


class Ready(Atomic):
    """Sends 1 when all hold and 0 when one does not any more.

    waiting --upright?, enabled?, trusted?--> saying (0), if that changes it --ready!--> waiting
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.upright = self.in_port("upright", int)
        self.enabled = self.in_port("enabled", int)
        self.trusted = self.in_port("trusted", bool)
        self.ready = self.out_port("ready", int)
        self.is_trusted = True
        self.is_upright = False
        self.is_enabled = False
        self.is_ready = False

    def output(self) -> None:
        """Send it."""
        self.ready.send(int(self.is_ready))

    def internal(self) -> None:
        """Wait for a change."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take in what has changed."""
        if self.upright:
            self.is_upright = self.upright[-1] == 1
        if self.enabled:
            self.is_enabled = self.enabled[-1] == 1
        if self.trusted:
            self.is_trusted = self.trusted[-1]
        was_ready = self.is_ready
        self.is_ready = self.is_upright and self.is_enabled and self.is_trusted
        if self.is_ready is was_ready:
            self.continue_(elapsed)
        else:
            self.activate("saying")
