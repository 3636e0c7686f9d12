"""What is to be explained of a late step."""

from msgspec import Struct

from firmware_runtime.statistics.blame import BlameRow

NOTHING = BlameRow()


class Late(Struct, frozen=True):
    """What the loop knows of a step that is to be explained; times in ns.

    `behind` and `wake` lie before it, `step` is how long it took, `usual_step` how long one takes.
    """

    ended: int
    behind: int
    wake: int
    step: int
    usual_step: int
    garbage: int
    previous_end: int

    @property
    def in_step(self) -> int:
        """What the step took longer than is usual."""
        return max(self.step - self.usual_step, 0)

    @property
    def of(self) -> int:
        """What is to be explained: the lateness, and that."""
        return self.behind + self.wake + self.in_step
