"""One drive for both wheels: a motor that is mounted the other way round turns the other way."""

from firmware_runtime.devs.atomic import Atomic


class Sides(Atomic):
    """waiting --drive?--> passing (0) --left! right!--> waiting."""

    def __init__(self, name: str, left_is_reversed: bool, right_is_reversed: bool) -> None:  # noqa: FBT001
        super().__init__(name)
        self.drive = self.in_port("drive", float)
        self.left = self.out_port("left", float)
        self.right = self.out_port("right", float)
        self._signs = (-1.0 if left_is_reversed else 1.0, -1.0 if right_is_reversed else 1.0)
        self._drive = 0.0

    def output(self) -> None:
        """Send the drive to each side."""
        left, right = self._signs
        self.left.send(left * self._drive)
        self.right.send(right * self._drive)

    def internal(self) -> None:
        """Wait for the next drive."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- it answers at once
        """Take the newest drive."""
        self._drive = self.drive[-1]
        self.activate("passing")
