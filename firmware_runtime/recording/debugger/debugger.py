"""The debugger: goes on to where it is to stop, and stops there, also in the middle of an instant.

An event is the call of one function of one model: at an instant the output functions of all that
are due, then their transitions. A stop in the middle of an instant is made within the call, so that
what is shown is what is there. To go back, the instant is finished, the state of a keyframe or of
where it has been is set back, and the run is run again up to the event before.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Final, NamedTuple

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.functions import CONFLUENT, FUNCTIONS, Functions, Wrapped
from firmware_runtime.errors import text_of
from firmware_runtime.recording.debugger.model_state import Models
from firmware_runtime.recording.debugger.predicate import Predicate, Seen
from firmware_runtime.recording.debugger.travel import Travel


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


BOUNDARY: Final = "between two instants"


class Ended(BaseException):
    """The debugger is left, from wherever it has stopped."""


class Debugger:
    """Stops at its goal, and calls `stopped` with the reason; that sets the next goal.

    `attach` calls a function under an ordinary debugger.
    """

    def __init__(
        self,
        travel: Travel,
        stopped: Callable[[str], None],
        attach: Callable[[Callable[..., None], object, tuple[object, ...]], None],
    ) -> None:
        self.travel = travel
        self.models = Models(travel.player.simulator.root)
        self.stops = Stops()
        self.event: Event | None = None
        """Function that was called last at this instant; None between two."""
        self._count = 0
        self._stopped = stopped
        self._attach = attach
        self._is_muted = False
        self._paths: dict[int, str] = {}
        self._seen = 0
        self._is_within = False
        """True while a section is being taken."""

    # Where it is ----------------------------------------------------------------------------------

    @property
    def place(self) -> Place:
        """Sections taken, and events of the one under way."""
        return Place(self.travel.index, self._count)

    @property
    def at(self) -> int:
        """The instant of the run, ns."""
        return self.travel.at

    # Where to go ----------------------------------------------------------------------------------

    def stay(self) -> None:
        """Stop where it is, between two instants."""
        self.stops.goal = Goal(place=Place(self.travel.index, 0))

    def go_to_instant(self, at: int) -> None:
        """To where all up to and including an instant has happened. Raises ConfigError outside."""
        self.travel.check(at)
        self.stops.goal = Goal(place=Place(self.travel.index_after(at), 0))

    def go_back_events(self, count: int) -> None:
        """To before the last events."""
        index, event = self.place
        self.stops.goal = Goal(place=Place(index, event - count))

    def go_back_instants(self, count: int) -> None:
        """To before the last instants, that of the stop included."""
        index, event = self.place
        for _ in range(count - (1 if event else 0)):
            index = self.travel.step_before(index) or 1
        self.stops.goal = Goal(place=Place(index, 0))

    def go_until(self, predicate: Predicate | None) -> None:
        """To where the predicate begins to hold, or to a breakpoint."""
        self.stops.go_until(predicate)

    # Going there ----------------------------------------------------------------------------------

    def run(self) -> None:
        """Go from goal to goal until it is left."""
        try:
            while True:
                self._go_on()
        except Ended:
            return

    def _go_on(self) -> None:
        """To a place; or one section further."""
        if self.stops.goal.place is not None:
            index, event = self._resolved(self.stops.goal.place)
            self._be_at(index)
            self.stops.set(Goal(events=event), ignores_breakpoints=event > 0)
            if event == 0:
                self._stop(BOUNDARY)
                return
        if self.travel.index >= self.travel.length:
            self._stop(self.travel.ends_with)
            return
        is_step = self.travel.is_step(self.travel.index)
        self._seen = 0
        self._is_within = True
        self.travel.take(self._watched)
        self._is_within = False
        self._count, self.event = 0, None
        was_muted, self._is_muted = self._is_muted, False
        if not was_muted and is_step:
            self._after_instant()

    def _after_instant(self) -> None:
        failure = self.travel.player.failure
        if failure is not None:
            self._stop(f"the robot raised {type(failure).__name__}: {text_of(failure)}")
        elif self.stops.count_instant():
            self._stop(BOUNDARY)

    def _be_at(self, index: int) -> None:
        self.travel.go_to(index)
        self.models.update(self.travel.player.simulator.root)
        self._paths.clear()
        self._count, self.event = 0, None
        self.stops.seen.last, self.stops.seen.sent = self.travel.last, set()

    def _resolved(self, place: Place) -> Place:
        """A place whose events are counted from the beginning of a step, not from its end."""
        index, event = place
        while event < 0:
            step = self.travel.step_before(index)
            if step is None:
                return Place(1, 0)
            self._be_at(step)
            index, event = step, event + self._events_of_next()
        return Place(index, event)

    def _events_of_next(self) -> int:
        """Take a step to count its events."""
        self._is_muted, count = True, 0

        def counted(atomic: Atomic, functions: Functions) -> Functions:
            def call(function: Callable[..., None], *arguments: int) -> None:
                nonlocal count
                function(*arguments)
                count += 1

            return each_function(atomic, functions, lambda _, function: partial(call, function))

        self.travel.take(counted)
        self._is_muted = False
        return count

    # At each event --------------------------------------------------------------------------------

    def _watched(self, atomic: Atomic, functions: Functions) -> Functions:
        return each_function(
            atomic, functions, lambda name, call: partial(self._call, atomic, name, call)
        )

    def _call(
        self, atomic: Atomic, name: str, function: Callable[..., None], *arguments: int
    ) -> None:
        event = Event(self._path(atomic), name)
        attached = self._before(event)
        if attached:
            self._attach(function, getattr(type(atomic), name), arguments)
            self.stops.goal = Goal(events=1)  # back to the recording
        else:
            function(*arguments)
        self._count += 1
        self.event = event
        if not self._is_muted:
            self._after(event)

    def _before(self, event: Event) -> bool:
        """Stop at a breakpoint of this function; return whether a debugger is to be attached."""
        if self._is_muted or self.stops.ignores_breakpoints:
            return False
        mine = [each for each in self.stops.breakpoints if each.function == event]
        for each in mine:
            if not each.attaches and not self._is_muted:
                self._stop(f"breakpoint {each.number}, before {event}")
        attaching = [each for each in mine if each.attaches and not self._is_muted]
        for each in attaching:
            self.stops.breakpoints.remove(each)
        return bool(attaching)

    def _after(self, event: Event) -> None:
        self._see()
        reason = self.stops.reason(event)
        if reason is not None:
            self._stop(reason)
        self.stops.seen.sent.clear()

    def _see(self) -> None:
        """Take notice of what has been sent since the last event."""
        sent, ports = self.travel.player.sent, self.travel.player.ports
        for number, value in sent[self._seen :]:
            self.travel.last[ports[number]] = value
            self.stops.seen.sent.add(ports[number])
        self._seen = len(sent)
        self.stops.seen.last = self.travel.last

    def _stop(self, reason: str) -> None:
        self.stops.set(Goal(), ignores_breakpoints=False)
        self._stopped(reason)
        if self._is_within:
            self._is_muted = self.stops.goal.place is not None

    def _path(self, atomic: Atomic) -> str:
        path = self._paths.get(id(atomic))
        if path is None:
            path = self._paths[id(atomic)] = below_root(atomic.path)
        return path


def each_function(
    atomic: Atomic,
    functions: Functions,
    around: Callable[[str, Callable[..., None]], Callable[..., None]],
) -> Functions:
    """A model's functions, each with something around it that knows its name."""
    output, internal, external = (
        around(name, getattr(functions, name)) for name in FUNCTIONS[:CONFLUENT]
    )
    confluent = functions.confluent
    own = None if confluent is None else around(FUNCTIONS[CONFLUENT], confluent)
    return Wrapped(atomic, output, internal, external, own)
