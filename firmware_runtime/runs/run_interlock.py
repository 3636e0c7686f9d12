"""Whether the outputs of a run may be driven: what every driver that moves something asks."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firmware_runtime.runs.arming import Arming


class RightToDrive:
    """The interlock of one run: its `arming` decides once it has one.

    Without, a run that is `unsupervised` may drive, and no other.
    """

    def __init__(self, *, unsupervised: bool) -> None:
        self.arming: Arming | None = None
        self._is_unsupervised = unsupervised

    def __call__(self) -> bool:
        """Return whether outputs may be driven now."""
        arming = self.arming
        return self._is_unsupervised if arming is None else arming.interlock()

    def suspend(self, why: str) -> bool:
        """Have the outputs off until nothing speaks against them; False for a run with no say."""
        if self.arming is None:
            return False
        self.arming.suspend(why)
        return True
