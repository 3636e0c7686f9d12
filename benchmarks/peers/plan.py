"""What every engine of `bench peers` is to do: activations of one period, one of which stalls."""

from dataclasses import dataclass, field
from time import monotonic_ns, sleep


@dataclass(slots=True)
class Plan:
    """The task of one run, and the activations that came of it.

    `stall_at` is the activation in which the model itself stalls for `stall_ns`, 0: it never does.
    Where that one is skipped, as by a busy machine, the next one stalls.
    """

    period_ns: int
    periods: int
    stall_at: int = 0
    stall_ns: int = 0
    fired: list[tuple[int, int]] = field(default_factory=list)
    """The number of each by the model's own time, from 1, and its instant of CLOCK_MONOTONIC."""

    @property
    def period_s(self) -> float:
        """The period as the peers take it."""
        return self.period_ns / 1e9

    def fire(self, number: int) -> None:
        """Note an activation; stall in the one that was chosen."""
        before = self.fired[-1][0] if self.fired else 0
        self.fired.append((number, monotonic_ns()))
        if self.stall_ns > 0 and before < self.stall_at <= number:
            sleep(self.stall_ns / 1e9)
