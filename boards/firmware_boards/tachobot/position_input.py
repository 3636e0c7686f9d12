"""Input of positions of a tracking system outside: on the robot's side of any link."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.models.position_fix import PoseFix, PositionFix


class PositionInput(Atomic):
    """Passes every position on, at the same instant; keeps outputs disarmed while none comes.

    silent --position?, pose?--> sending (0) --position!, pose!--> receiving (timeout)
    receiving --position?, pose?--> sending;  --(timeout)--> silent

    The estimator, which knows more, may be in another process than the outputs.
    """

    def __init__(self, name: str, timeout: int) -> None:
        super().__init__(name)
        self.timeout = timeout
        self.position_in = self.in_port("position", PositionFix, takes="any")
        self.pose_in = self.in_port("pose", PoseFix, takes="any")
        self.position = self.out_port("position", PositionFix)
        self.pose = self.out_port("pose", PoseFix)
        self._positions: tuple[PositionFix, ...] = ()
        self._poses: tuple[PoseFix, ...] = ()

    def unready(self) -> str | None:
        """Return the reason for no position, in a few words; None while positions come."""
        return "receives no position" if self.phase == "silent" else None

    def initialize(self) -> None:
        """Wait for the first."""
        self.passivate("silent")

    def output(self) -> None:
        """Send what came."""
        for position in self._positions:
            self.position.send(position)
        for pose in self._poses:
            self.pose.send(pose)

    def internal(self) -> None:
        """Wait for more, for no longer than the timeout."""
        if self.phase == "sending":
            self._positions, self._poses = (), ()
            self.hold_in("receiving", self.timeout)
        else:
            self.passivate("silent")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- it has no time of its own
        """Keep what came until it is sent."""
        self._positions, self._poses = (*self.position_in,), (*self.pose_in,)
        self.activate("sending")
