"""The processor: works on one job at a time."""

from firmware_runtime import MILLISECOND, Atomic


class Processor(Atomic):
    """Sends a job when it is done with it; what comes meanwhile is lost.

    idle --in?--> busy (processing) --out! job--> idle
    """

    def __init__(self, name: str, processing: int = 1500 * MILLISECOND) -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", int)
        self.out = self.out_port("out", int)
        self.processing = processing
        self.job = 0

    def initialize(self) -> None:
        """Wait for a job."""
        self.passivate("idle")

    def output(self) -> None:
        """Send the job that is done."""
        self.out.send(self.job)

    def internal(self) -> None:
        """Wait for the next."""
        self.passivate("idle")

    def external(self, elapsed: int) -> None:
        """Begin with a job; one at a time."""
        if self.phase == "idle":
            self.job = self.entrance[0]
            self.hold_in("busy", self.processing)
        else:
            self.continue_(elapsed)
