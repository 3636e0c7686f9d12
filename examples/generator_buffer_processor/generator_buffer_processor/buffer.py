"""The buffer: keeps jobs in order and hands one on when the processor is done with the last."""

from collections import deque

from firmware_runtime import MILLISECOND, Atomic


class Buffer(Atomic):
    """Prepares the oldest job and sends it; sends the next only after `done`.

    idle --in?--> preparing (preparation) --out! job--> waiting for done --done?--> preparing | idle
    """

    def __init__(self, name: str, preparation: int = 100 * MILLISECOND) -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", int)
        self.done = self.in_port("done", int)
        self.out = self.out_port("out", int)
        self.preparation = preparation
        self.jobs: deque[int] = deque()

    def initialize(self) -> None:
        """Begin empty."""
        self.jobs = deque()
        self.passivate("idle")

    def output(self) -> None:
        """Send the oldest job."""
        self.out.send(self.jobs[0])

    def internal(self) -> None:
        """The processor has it now."""
        self.jobs.popleft()
        self.passivate("waiting for done")

    def external(self, elapsed: int) -> None:
        """Take jobs in; prepare one if the processor has none."""
        self.jobs.extend(self.entrance)
        if self.phase == "waiting for done" and self.done:
            self.passivate("idle")
        if self.phase == "idle" and self.jobs:
            self.hold_in("preparing", self.preparation)
        else:
            self.continue_(elapsed)
