"""Quality of a position, by how long ago the last one came that was believed: a state diagram."""

from dataclasses import dataclass

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.hal.wire_errors import Fault, NotReady
from firmware_runtime.models.position_fix import FixReport, PositionState
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, Kept, State, Word, always


@dataclass(frozen=True, slots=True)
class PositionPatience:
    """Ns without a position, counted from the last one, each longer than the one before."""

    coasts: int
    """After which the body goes on by its inertial unit alone."""
    lost: int
    """After which it brakes and holds its yaw."""
    safe: int
    """After which it is switched off."""


class PositionWatch(StateDiagram):
    """Says how good the position is whenever that changes, and reports that there is none.

    no position --fix?--> found (0) --state! TRACKING--> tracking
    tracking (coasts) --fix?--> tracking;  --state! COASTING, fault!--> coasting
    coasting (lost) --fix?--> found;  --state! LOST, fault!--> lost
    lost (safe) --fix?--> found;  --state! SAFE--> safe
    """

    def __init__(self, name: str, patience: PositionPatience) -> None:
        super().__init__(name)
        self.fix = self.in_port("fix", FixReport)
        self.state = self.out_port("state", PositionState)
        self.fault = self.out_port("fault", Fault)
        self.follow(
            (
                State("no position", NEVER, Arrow("fix?any", "found")),
                State("found", 0, Arrow("state!tracking", "tracking")),
                State(
                    "tracking",
                    "coasts",
                    Arrow("fix?any", "tracking"),
                    Arrow("state!coasting fault!coasts", "coasting"),
                ),
                State(
                    "coasting",
                    "lost",
                    Arrow("fix?any", "found"),
                    Arrow("state!lost fault!loses", "lost"),
                ),
                State("lost", "safe", Arrow("fix?any", "found"), Arrow("state!safe", "safe")),
                State("safe", NEVER),
            ),
            {
                "any": _any,
                "coasts": self._none_for(patience.coasts),
                "loses": self._none_for(patience.lost),
                **{state.name.lower(): always(state) for state in PositionState},
            },
            coasts=patience.coasts,
            lost=patience.lost - patience.coasts,
            safe=patience.safe - patience.lost,
        )

    def _none_for(self, span: int) -> Word:
        sentence, expected = f"no position was believed for {span / SECOND:g} s", "one that agrees"

        def fault(_kept: Kept) -> Fault:
            return Fault.of(NotReady(sentence, where=self.path, expected=expected), 1)

        return fault


def _any(_fix: FixReport, _kept: Kept) -> bool:
    return True
