"""The declaration of a state diagram: states with durations, and labelled arrows between them.

A table is written the way GGAD draws it. A state is a circle with a duration; an external
transition is an arrow labelled `port?value`, an internal one is labelled with what is sent before
it, `port!value`, more than one if need be, or nothing.

    State("Idle", NEVER, Arrow("question?1", "Answering")),
    State("Answering", "hop", Arrow("answer!42 answered!1", "Idle")),

The first state is the initial one. A duration is a number of nanoseconds, NEVER, or a word that
the model replaces by one of its parameters. A value in a label is one of three:

- a number stands for itself, as the port's type makes it: `order?1` on a port of int takes the
  input 1, and on a port of a class `Message` the input `Message(1)`;
- a word for a class: `in?heading` takes an input of that class and keeps it under the word,
  `out!heading` sends what was kept;
- a word for a function: `in?match` takes an input for which `function(value, kept)` is true,
  `out!sum` sends `function(kept)`.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias, TypeVar

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort, carries
from firmware_runtime.devs.time import NEVER

Kept: TypeAlias = dict[str, Any]
"""Values that came with inputs and are kept for later, by their words."""

_MARK = re.compile(r"(?P<port>[^\s?!]+)(?P<sign>[?!])(?P<value>[^\s?!]+)")


class StateTableError(ModelError, ValueError):
    """A table that cannot be followed: an undeclared name, a state without way in or out."""


class Mark(NamedTuple):
    """One `port?value` or `port!value` of a label."""

    port: str
    sign: str
    value: str

    def __str__(self) -> str:
        return "".join(self)


@dataclass(frozen=True, slots=True)
class Arrow:
    """A transition: its label, the state it leads to, and a condition on what was kept before."""

    label: str
    to: str
    when: Callable[[Kept], bool] | None = None

    @property
    def marks(self) -> tuple[Mark, ...]:
        """The label taken apart; raises StateTableError if it is none."""
        marks = [_MARK.fullmatch(word) for word in self.label.split()]
        signs = {mark["sign"] for mark in marks if mark}
        if None in marks or len(signs) > 1 or ("?" in signs and len(marks) > 1):
            raise StateTableError(
                f"label {self.label!r}: expected one port?value, or any number of port!value"
            )
        return tuple(Mark(**mark.groupdict()) for mark in marks if mark)

    @property
    def is_external(self) -> bool:
        """An input takes this arrow; the others are taken when the duration is over."""
        return "?" in self.label

    @property
    def condition(self) -> str:
        """The condition in words, from its function's name; empty if there is none."""
        return getattr(self.when, "__name__", "").replace("_", " ").strip()


class State:
    """A state, how long it lasts, and the arrows that leave it, those for inputs in any order.

    The duration of a state that is `moving` is one of motion: it stands still while the actuators
    apply nothing (`StateDiagram.applied_in`).
    """

    def __init__(
        self, name: str, duration: int | str, *arrows: Arrow, moving: bool = False
    ) -> None:
        self.name = name
        self.duration = duration
        self.arrows = arrows
        self.moving = moving

    @property
    def external(self) -> tuple[Arrow, ...]:
        """The arrows that inputs take, in order of preference."""
        return tuple(arrow for arrow in self.arrows if arrow.is_external)

    @property
    def internal(self) -> tuple[Arrow, ...]:
        """The arrows taken when the duration is over; the first whose condition holds."""
        return tuple(arrow for arrow in self.arrows if not arrow.is_external)


def check(states: Sequence[State]) -> None:
    """Raise StateTableError with the first fault that the table shows by itself."""
    names = [state.name for state in states]
    if not states or len(set(names)) < len(names):
        raise StateTableError(f"states {names}: expected at least one, each declared once")
    for state in states:
        for arrow in state.arrows:
            if arrow.to not in names:
                raise StateTableError(f"state {state.name!r}: no state {arrow.to!r} to lead to")
        _check_internal(state)
    lost = set(names) - set(_reachable(states))
    if lost:
        raise StateTableError(f"no arrow leads from {names[0]!r} to {sorted(lost)}")


def _check_internal(state: State) -> None:
    if (state.duration == NEVER) != (not state.internal):
        raise StateTableError(
            f"state {state.name!r}: expected an arrow without input if it ends, none if it does not"
        )
    if len(state.internal) > 1 and not all(arrow.when for arrow in state.internal):
        raise StateTableError(
            f"state {state.name!r}: of several arrows without input each needs a condition"
        )


def _reachable(states: Sequence[State]) -> Iterator[str]:
    by_name = {state.name: state for state in states}
    seen = {states[0].name}
    ahead = [states[0].name]
    while ahead:
        name = ahead.pop()
        yield name
        for arrow in by_name[name].arrows:
            if arrow.to not in seen:
                seen.add(arrow.to)
                ahead.append(arrow.to)


Word: TypeAlias = type | Callable[..., Any]
Words: TypeAlias = Mapping[str, Word]


def always(value: object) -> Word:
    """Return a word for what is sent, whatever was kept: this value."""
    return lambda _kept: value


P = TypeVar("P")

_NUMBER = re.compile(r"[+-]?\d+(\.\d+)?")


class Accepted(NamedTuple):
    """A `port?value`: which inputs of the port it takes, and the word to keep them under."""

    port: InPort[Any]
    accepts: Callable[[Any, Kept], bool]
    word: str | None


class Sent(NamedTuple):
    """A `port!value`: what to send on the port, given what was kept."""

    port: OutPort[Any]
    value: Callable[[Kept], Any]


class Labels:
    """Takes labels to the ports of one model and the meanings of its words."""

    def __init__(self, model: Component, words: Words) -> None:
        self._model = model
        self._words = words

    def accepted(self, mark: Mark) -> Accepted:
        """Return what a `port?value` takes; raises StateTableError for an unknown port or word."""
        port = _port(self._model.in_ports, mark, "input")
        word = self._words.get(mark.value)
        if isinstance(word, type):
            return Accepted(port, lambda value, _kept: carries(word, type(value)), mark.value)
        if word is not None:
            return Accepted(port, word, None)
        number = self._number(port, mark)
        return Accepted(port, lambda value, _kept: bool(value == number), None)

    def sent(self, mark: Mark) -> Sent:
        """Return what a `port!value` sends; raises StateTableError for an unknown port or word."""
        port = _port(self._model.out_ports, mark, "output")
        word = self._words.get(mark.value)
        if isinstance(word, type):
            return Sent(port, lambda kept: kept[mark.value])
        if word is not None:
            return Sent(port, word)
        number = self._number(port, mark)
        return Sent(port, always(number))

    def keeps(self, mark: Mark) -> bool:
        """Return whether this value is one that an input leaves behind."""
        return isinstance(self._words.get(mark.value), type)

    def _number(self, port: AnyPort, mark: Mark) -> object:
        if not _NUMBER.fullmatch(mark.value):
            words = ", ".join(self._words) or "none"
            raise StateTableError(f"expected a number or a declared word ({words})", where=mark)
        try:
            made: object = port.type(float(mark.value) if "." in mark.value else int(mark.value))
        except (TypeError, ValueError) as error:
            kind = port.type.__name__
            raise StateTableError(f"a port of {kind} carries no number", where=mark) from error
        return made


def _port(ports: Mapping[str, P], mark: Mark, kind: str) -> P:
    if mark.port not in ports:
        known = ", ".join(ports) or "none"
        raise StateTableError(
            f"no {kind} port {mark.port!r}", where=mark, expected=f"one of {known}"
        )
    return ports[mark.port]
