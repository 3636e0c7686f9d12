"""The generator: a job every period, while it is switched on."""

from firmware_runtime import SECOND, Atomic


class Generator(Atomic):
    """Sends jobs 1, 2, 3 and so on, the first a period after it was switched on.

    off --in? not 0--> on (period) --out! number--> on;  on --in? 0--> off
    """

    def __init__(self, name: str, period: int = SECOND) -> None:
        super().__init__(name)
        self.switch = self.in_port("in", float)
        self.out = self.out_port("out", int)
        self.period = period
        self.number = 1

    def initialize(self) -> None:
        """Wait to be switched on."""
        self.number = 1
        self.passivate("off")

    def output(self) -> None:
        """Send the next job."""
        self.out.send(self.number)

    def internal(self) -> None:
        """Begin the next period."""
        self.number += 1
        self.hold_in("on", self.period)

    def external(self, elapsed: int) -> None:
        """Switch on or off; one that is on already goes on."""
        if not self.switch[-1]:
            self.passivate("off")
        elif self.phase == "off":
            self.hold_in("on", self.period)
        else:
            self.continue_(elapsed)
