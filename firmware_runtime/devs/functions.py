"""A model's functions as the simulator calls them, bound once, before the run.

An `Instrument` may wrap them: the executive to measure time, the checked mode to watch the laws.
What is not wrapped costs nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from firmware_runtime.devs.atomic import Atomic


@dataclass(slots=True)
class Functions:
    """Output, internal, external and confluent; `confluent` None means internal, then external."""

    output: Callable[[], None]
    internal: Callable[[], None]
    external: Callable[[int], None]
    confluent: Callable[[], None] | None


Instrument: TypeAlias = Callable[[Atomic, Functions], Functions]
"""Given a model and its functions, the functions to call instead."""


def functions_of(atomic: Atomic, instruments: Sequence[Instrument]) -> Functions:
    """Bind the model's functions and let each instrument wrap them, the first one innermost."""
    kind = type(atomic)
    confluent = None if kind.confluent is Atomic.confluent else atomic.confluent
    functions = Functions(atomic.output, atomic.internal, atomic.external, confluent)
    if kind.time_advance is not Atomic.time_advance:
        functions = _with_own_time_advance(atomic, functions)
    for instrument in instruments:
        functions = instrument(atomic, functions)
    return functions


def _with_own_time_advance(atomic: Atomic, functions: Functions) -> Functions:
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
