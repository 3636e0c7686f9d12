"""An atomic model that follows a table of states, written as its state diagram is drawn.

A subclass declares its ports, then calls `follow` with its table (see `state_table`), its words
, and the durations that the table names.

An input that the present state does not name has no effect and leaves the state's duration
running. Inputs of one instant are taken one after the other, ports in order of declaration, each
by the state that is then the present one. An arrow that leads back to its own state restarts its
duration.

A diagram that commands something that moves for a time sets `applied_in` to an input port of
`Applied`, which is no input of the table: the durations of states that are `moving` stand still
while nothing is applied.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.motion import Applied
from firmware_runtime.models.state_table import (
    Accepted,
    Arrow,
    Kept,
    Labels,
    Sent,
    State,
    StateTableError,
    Words,
    check,
)

_NO_WORDS: Words = MappingProxyType({})


class StateDiagram(Atomic):
    """Follows a table; `phase` is the state's name, `kept` holds values from inputs by their words.

    `states` is the table as declared, `durations` each state's duration in ns: what a picture of
    the diagram is drawn from.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.states: Sequence[State] = ()
        self.durations: dict[str, int] = {}
        self.kept: Kept = {}
        self.applied_in: InPort[Applied] | None = None
        self.applied = Applied.ALL
        self.watch: Callable[[str], None] | None = None
        """Called with every state that is entered, for a picture of a run; it may only read."""
        self._external: dict[str, tuple[tuple[Accepted, Arrow], ...]] = {}
        """By state the arrows that inputs take."""
        self._internal: dict[str, tuple[tuple[tuple[Sent, ...], Arrow], ...]] = {}
        """Arrows taken when a state's duration is over, with what is sent then."""
        self._moving: frozenset[str] = frozenset()
        self._left = NEVER
        """What is left of the duration of a moving state that stands still."""

    def follow(self, states: Sequence[State], words: Words = _NO_WORDS, **durations: int) -> None:
        """Take the table to follow, in place of any before; called after the ports were declared.

        Raises StateTableError if the table does not hold together or does not fit the model.
        """
        try:
            check(states)
            self.states = states
            self._moving = frozenset(state.name for state in states if state.moving)
            self.durations = {state.name: _duration(state, durations) for state in states}
            labels = Labels(self, words)
            for state in states:
                self._external[state.name] = tuple(
                    (labels.accepted(mark), each) for each in state.external for mark in each.marks
                )
                self._internal[state.name] = tuple(
                    (tuple(map(labels.sent, each.marks)), each) for each in state.internal
                )
            _check_kept(states, labels)
        except StateTableError as error:
            raise StateTableError(error, where=self.path) from error

    # The DEVS functions -------------------------------------------------------------------------

    def initialize(self) -> None:
        """Begin in the first state, with nothing kept."""
        self.kept = {}
        self._enter(self.states[0].name)

    def output(self) -> None:
        """Send what the label of the arrow to be taken says."""
        sent, _ = self._due()
        for port, value in sent:
            port.send(value(self.kept))

    def internal(self) -> None:
        """The state's duration is over: take the arrow."""
        _, arrow = self._due()
        self._enter(arrow.to)

    def external(self, elapsed: int) -> None:
        """Offer every input to the state that is then the present one."""
        self.continue_(elapsed)
        for port in self.in_ports.values():
            if port is self.applied_in and port:
                self._follow_applied(port[-1])
            else:
                for value in port:
                    self._offer(port, value)

    # ---------------------------------------------------------------------------------------------

    def _enter(self, state: str) -> None:
        self.hold_in(state, self.durations[state])
        self._left = NEVER
        self._follow_applied(self.applied)
        if self.watch is not None:
            self.watch(state)

    def _follow_applied(self, applied: Applied) -> None:
        """Stop the time of a moving state while nothing is applied, and go on with it after."""
        self.applied = applied
        if applied is Applied.NOTHING and self.phase in self._moving and self.sigma != NEVER:
            self._left, self.sigma = self.sigma, NEVER
        elif applied is not Applied.NOTHING and self._left != NEVER:
            self.sigma, self._left = self._left, NEVER

    def _due(self) -> tuple[tuple[Sent, ...], Arrow]:
        for sent, arrow in self._internal[self.phase]:
            if self._is_open(arrow):
                return sent, arrow
        raise LookupError("no arrow's condition holds")

    def _offer(self, port: InPort[object], value: object) -> None:
        for label, arrow in self._external[self.phase]:
            if label.port is port and label.accepts(value, self.kept) and self._is_open(arrow):
                if label.word is not None:
                    self.kept[label.word] = value
                self._enter(arrow.to)
                return

    def _is_open(self, arrow: Arrow) -> bool:
        return arrow.when is None or arrow.when(self.kept)


def _duration(state: State, durations: Mapping[str, int]) -> int:
    """The state's duration in ns, looked up if the table gives a word for it."""
    duration = state.duration
    if isinstance(duration, str):
        if duration not in durations:
            known = ", ".join(durations) or "none"
            raise StateTableError(
                f"state {state.name!r}: duration {duration!r}", expected=f"one of {known}"
            )
        duration = durations[duration]
    if type(duration) is not int or duration < 0:
        raise StateTableError(
            f"state {state.name!r}: duration {duration!r}",
            expected="whole nanoseconds, zero or more",
        )
    return duration


def _check_kept(states: Sequence[State], labels: Labels) -> None:
    """Check that what is sent from what was kept is kept by some arrow."""
    marks = [mark for state in states for arrow in state.arrows for mark in arrow.marks]
    kept = {mark.value for mark in marks if mark.sign == "?"}
    for mark in marks:
        if labels.keeps(mark) and mark.value not in kept:
            raise StateTableError(f"no input ever keeps a {mark.value!r}", where=mark)
