"""Sonar1 and Compass1 on the radar, Sonar2 and Compass2 on the body.

Their readings come in as numbers, from an event file or from the chips' drivers. What they report
goes to their controller.
"""

from typing import Final

from firmware_boards.detective.angles import are_close, is_between
from firmware_boards.detective.messages import Degree, Message
from firmware_boards.detective.parameters import HOP, TOLERANCE_DEG
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, Kept, State, Words

SONAR1: Final = (
    State("Listen", NEVER, Arrow("echo?1", "Report object")),
    State("Report object", "hop", Arrow("object!1", "Listen")),
)

COMPASS1: Final = (
    State("Idle", NEVER, Arrow("request?1", "Wait for reading")),
    State("Wait for reading", NEVER, Arrow("reading?angle", "Report degree")),
    State("Report degree", "hop", Arrow("degree!degree", "Idle")),
)

SONAR2: Final = (
    State("Idle", NEVER, Arrow("request?1", "Listen")),
    State("Listen", NEVER, Arrow("echo?not_zero", "Report target")),
    State("Report target", "hop", Arrow("target!1", "Idle")),
)

COMPASS2: Final = (
    State(
        "Idle",
        NEVER,
        Arrow("request?1", "Wait for heading"),
        Arrow("request?target", "Match"),
    ),
    State("Wait for heading", NEVER, Arrow("reading?angle", "Report heading")),
    State("Report heading", "hop", Arrow("answer!heading", "Idle")),
    State("Match", NEVER, Arrow("reading?match", "Report match")),
    State("Report match", "hop", Arrow("answer!1", "Idle")),
)


class Sonar1(StateDiagram):
    """Reports an object when its sensor gives 1; it has no start signal, see README.md."""

    def __init__(self, name: str, hop: int = HOP) -> None:
        super().__init__(name)
        self.hop = hop
        self.echo = self.in_port("echo", float)
        self.object = self.out_port("object", int)
        self.follow(SONAR1, hop=hop)


class Compass1(StateDiagram):
    """Asked once, reports the next angle its sensor gives."""

    def __init__(self, name: str, hop: int = HOP) -> None:
        super().__init__(name)
        self.hop = hop
        self.request = self.in_port("request", int)
        self.reading = self.in_port("reading", float)
        self.degree = self.out_port("degree", Degree)
        self.follow(COMPASS1, {"angle": float, "degree": _angle}, hop=hop)


class Sonar2(StateDiagram):
    """Asked once, reports the target as soon as its sensor gives anything but zero."""

    def __init__(self, name: str, hop: int = HOP) -> None:
        super().__init__(name)
        self.hop = hop
        self.request = self.in_port("request", int)
        self.echo = self.in_port("echo", float)
        self.target = self.out_port("target", int)
        self.follow(SONAR2, {"not_zero": _is_not_zero}, hop=hop)


class Compass2(StateDiagram):
    """Asked with the signal 1, reports the next heading; given an angle, reports when they match.

    With a tolerance they match as well where one reading is on one side of the angle and the next
    on the other: a reading that is wrong may leap over it, and the robot would turn all the way
    round. Without one it is the paper's.

    Raises ValueError if the tolerance is negative: then nothing would ever match.
    """

    def __init__(self, name: str, hop: int = HOP, tolerance_deg: float = TOLERANCE_DEG) -> None:
        super().__init__(name)
        if not tolerance_deg >= 0:
            raise ValueError(f"{name}: tolerance {tolerance_deg} degrees, expected zero or more")
        self.request = self.in_port("request", Message)
        self.reading = self.in_port("reading", float)
        self.answer = self.out_port("answer", Message)
        self.hop = hop
        self.tolerance_deg = tolerance_deg
        words: Words = {
            "angle": float,
            "heading": _angle,
            "target": Degree,
            "match": self._is_match,
        }
        self._before: float | None = None
        """The reading before, since it was asked."""
        self.follow(COMPASS2, words, hop=hop)

    def external(self, elapsed: int) -> None:
        """Take a reading, or begin anew with a request."""
        if self.request:
            self._before = None
        super().external(elapsed)

    def _is_match(self, reading: float, kept: Kept) -> bool:
        target: Degree = kept["target"]
        before, self._before = self._before, reading
        if are_close(reading, target.value, self.tolerance_deg):
            return True
        may_leap = self.tolerance_deg > 0
        return may_leap and before is not None and is_between(before, target.value, reading)


def _angle(kept: Kept) -> Degree:
    return Degree(kept["angle"])


def _is_not_zero(reading: float, _kept: Kept) -> bool:
    return reading != 0
