"""What the kernel counts of a thread, set by a test."""

from firmware_runtime.devs.time import MICROSECOND
from firmware_runtime.system.thread_counters import Reading


class Counters:
    """Stands in for the kernel: what it counts is set by the test."""

    def __init__(self) -> None:
        self.cpu_ns = self.run_delay_ns = self.voluntary = self.reads = 0
        self.minor_faults = self.major_faults = 0
        self.traced = False

    def read(self) -> Reading:
        self.reads += 1
        schedule = b"0 %d 1" % self.run_delay_ns
        usage = (self.minor_faults, self.major_faults, self.voluntary, 0)
        return Reading(
            self.cpu_ns, usage, frozenset({0}), 0, 0, schedule, None, None, None, None, []
        )

    def pass_steps(self, steps: int) -> None:
        """What is usual for so many: each runs 300 us and waits 40 us for its turn."""
        self.cpu_ns += 300 * MICROSECOND * steps
        self.run_delay_ns += 40 * MICROSECOND * steps

    def supply(self) -> int | None:
        return None

    def is_traced(self) -> bool:
        return self.traced

    def close(self) -> None:
        self.reads = -1
