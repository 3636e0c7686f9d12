"""A model's functions as the simulator calls them, bound once, before the run.

An `Instrument` may wrap them: the executive to measure time, the checked mode to watch the laws.
A model that nobody wraps is called as it is.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from firmware_runtime.devs.atomic import Atomic


@dataclass(frozen=True, slots=True)
class Functions:
    """Output, internal, external and confluent; `confluent` None means internal, then external."""

    output: Callable[[], None]
    internal: Callable[[], None]
    external: Callable[[int], None]
    confluent: Callable[[], None] | None


Instrument: TypeAlias = Callable[[Atomic, Functions], Functions]
"""Given a model and its functions, the functions to call instead."""


class Wrapped:
    """Stands before a model whose functions are wrapped; to the simulator it is the model."""

    __slots__ = ("atomic", "external", "internal", "output")

    def __init__(self, atomic: Atomic, functions: Functions) -> None:
        self.atomic = atomic
        self.output = functions.output
        self.internal = functions.internal
        self.external = functions.external

    @property
    def sigma(self) -> int:
        """The model's time advance."""
        return self.atomic.sigma


def bind(
    atomics: Sequence[Atomic], instruments: Sequence[Instrument]
) -> tuple[list[Atomic | Wrapped], dict[int, Callable[[], None]]]:
    """What to call for each model, and those confluent functions that are not the default one."""
    models: list[Atomic | Wrapped] = list(atomics)
    own_confluents: dict[int, Callable[[], None]] = {}
    for number, atomic in enumerate(atomics):
        confluent = _own_confluent(atomic)
        if instruments or _computes_time_advance(atomic):
            functions = _functions_of(atomic, instruments)
            models[number] = Wrapped(atomic, functions)
            confluent = functions.confluent
        if confluent is not None:
            own_confluents[number] = confluent
    return models, own_confluents


def _own_confluent(atomic: Atomic) -> Callable[[], None] | None:
    return None if type(atomic).confluent is Atomic.confluent else atomic.confluent


def _computes_time_advance(atomic: Atomic) -> bool:
    return type(atomic).time_advance is not Atomic.time_advance


def _functions_of(atomic: Atomic, instruments: Sequence[Instrument]) -> Functions:
    """The model's functions with each instrument around them, the first one innermost."""
    functions = Functions(atomic.output, atomic.internal, atomic.external, _own_confluent(atomic))
    if _computes_time_advance(atomic):
        functions = _asking_time_advance(atomic, functions)
    for instrument in instruments:
        functions = instrument(atomic, functions)
    return functions


def _asking_time_advance(atomic: Atomic, functions: Functions) -> Functions:
    """For a model that computes its time advance: ask after each transition, keep it in sigma."""

    def internal() -> None:
        functions.internal()
        atomic.sigma = atomic.time_advance()

    def external(elapsed: int) -> None:
        functions.external(elapsed)
        atomic.sigma = atomic.time_advance()

    def confluent() -> None:
        atomic.confluent()
        atomic.sigma = atomic.time_advance()

    return replace(functions, internal=internal, external=external, confluent=confluent)
