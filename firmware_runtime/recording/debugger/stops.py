"""Stops of the debugger: places, events, breakpoints, and the goal that is gone to."""

from dataclasses import dataclass, field
from typing import NamedTuple

from firmware_runtime.recording.debugger.predicate import Predicate, Seen


class Place(NamedTuple):
    """So many sections taken, and so many events of the next."""

    sections: int
    event: int


class Event(NamedTuple):
    """A function of a model that has been called."""

    path: str
    function: str

    def __str__(self) -> str:
        return f"{self.path} {self.function}"


@dataclass(slots=True)
class Goal:
    """Next place to stop, apart from breakpoints; nothing: at breakpoints alone."""

    place: Place | None = None
    events: int = 0
    """So many events further."""
    instants: int = 0
    """So many instants further."""
    until: Predicate | None = None


@dataclass(slots=True)
class Breakpoint:
    """A predicate, or a function of a model; one that `attaches` an ordinary debugger does once."""

    number: int
    text: str
    predicate: Predicate | None = None
    function: Event | None = None
    attaches: bool = False
    held: bool = field(default=False)


class Stops:
    """Says at each event and each instant whether to stop there, and why.

    Predicates are evaluated on `seen`. Breakpoints are passed by while `ignores_breakpoints`.
    """

    def __init__(self) -> None:
        self.goal = Goal()
        self.breakpoints: list[Breakpoint] = []
        self.seen = Seen()
        self.ignores_breakpoints = False
        self._held = False

    def set(self, goal: Goal, *, ignores_breakpoints: bool) -> None:
        """Go there next."""
        self.goal, self.ignores_breakpoints = goal, ignores_breakpoints

    def go_until(self, predicate: Predicate | None) -> None:
        """Go to where the predicate begins to hold, or to a breakpoint."""
        self._held = predicate is not None and predicate.holds(self.seen)
        self.goal = Goal(until=predicate)

    def count_instant(self) -> bool:
        """Another instant is over; return whether it was the last that the goal asks for."""
        if not self.goal.instants:
            return False
        self.goal.instants -= 1
        return self.goal.instants == 0

    def reason(self, event: Event) -> str | None:
        """Return why to stop after an event; None to go on."""
        goal = self.goal
        if goal.events:
            goal.events -= 1
            if goal.events == 0:
                return f"after {event}"
        if goal.until is not None:
            held, self._held = self._held, goal.until.holds(self.seen)
            if self._held and (goal.until.of_sending or not held):
                return f"{goal.until.text}, after {event}"
        return None if self.ignores_breakpoints else self._broken(event)

    def _broken(self, event: Event) -> str | None:
        for each in self.breakpoints:
            if each.predicate is not None:
                held, each.held = each.held, each.predicate.holds(self.seen)
                if each.held and (each.predicate.of_sending or not held):
                    return f"breakpoint {each.number}: {each.text}, after {event}"
        return None
