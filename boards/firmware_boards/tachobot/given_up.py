"""Ends the run when the position was given up."""

from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.position_fix import PositionState
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, Kept, State


class GivenUp(StateDiagram):
    """Says once that the run has failed.

    watching --state? SAFE--> ending (0) --ended!--> over
    """

    def __init__(self, name: str, safe_after_s: float) -> None:
        super().__init__(name)
        self.state = self.in_port("state", PositionState)
        self.ended = self.out_port("ended", Ending)
        self._ending = Ending(f"no position for {safe_after_s:g} s", failed=True)
        self.follow(
            (
                State("watching", NEVER, Arrow("state?safe", "ending")),
                State("ending", 0, Arrow("ended!failure", "over")),
                State("over", NEVER),
            ),
            {"safe": _is_safe, "failure": self._failure},
        )

    def _failure(self, _kept: Kept) -> Ending:
        return self._ending


def _is_safe(state: PositionState, _kept: Kept) -> bool:
    return state is PositionState.SAFE
