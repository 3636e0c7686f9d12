"""What the labels of a state diagram mean on a given model: ports, values, words.

A value in a label is one of three:

- a number stands for itself, as the port's type makes it: `order?1` on a port of int takes the
  input 1, and on a port of a class `Message` the input `Message(1)`;
- a word for a class: `in?heading` takes an input of that class and keeps it under the word,
  `out!heading` sends what was kept;
- a word for a function: `in?match` takes an input for which `function(value, kept)` is true,
  `out!sum` sends `function(kept)`.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeAlias, TypeVar

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort, carries
from firmware_runtime.models.state_table import Kept, Mark, StateTableError

Word: TypeAlias = type | Callable[..., Any]
Words: TypeAlias = Mapping[str, Word]
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
        """What a `port?value` takes; raises StateTableError for an unknown port or word."""
        port = _port(self._model.in_ports, mark, "input")
        word = self._words.get(mark.value)
        if isinstance(word, type):
            return Accepted(port, lambda value, _kept: carries(word, type(value)), mark.value)
        if word is not None:
            return Accepted(port, word, None)
        number = self._number(port, mark)
        return Accepted(port, lambda value, _kept: bool(value == number), None)

    def sent(self, mark: Mark) -> Sent:
        """What a `port!value` sends; raises StateTableError for an unknown port or word."""
        port = _port(self._model.out_ports, mark, "output")
        word = self._words.get(mark.value)
        if isinstance(word, type):
            return Sent(port, lambda kept: kept[mark.value])
        if word is not None:
            return Sent(port, word)
        number = self._number(port, mark)
        return Sent(port, lambda _kept: number)

    def keeps(self, mark: Mark) -> bool:
        """Whether this value is one that an input leaves behind."""
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
