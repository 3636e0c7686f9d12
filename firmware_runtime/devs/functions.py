"""A model's functions as the simulator calls them, bound once, before the run.

An `Instrument` may put something else in a model's place: the checked mode to watch the laws, a
debugger to stop. A model without one, or whose instruments leave its functions as they are, is
called as it is.

What is only to be noted needs no instrument: a `Laps` gets an entry for each function called.
"""

from collections.abc import Callable, Sequence
from typing import Final, Protocol, TypeAlias

from firmware_runtime.devs.atomic import Atomic

OUTPUT: Final = 0
INTERNAL: Final = 1
EXTERNAL: Final = 2
CONFLUENT: Final = 3
INTERNAL_OF_BOTH: Final = 4
"""Of a model whose confluent function is the default one: internal, then external."""
EXTERNAL_OF_BOTH: Final = 5
FUNCTIONS: Final = ("output", "internal", "external", "confluent", "internal", "external")
"""Names of a model's functions, by these numbers."""


class Laps:
    """What a simulator notes of each function of a model as soon as it has returned.

    `noted` has four entries for each: the model's number, the function's, what `read` returned, and
    the time advance that a transition has left. The reader empties it before the next
    advance. `read` is the source of a clock itself, so that no frame stands around it.
    """

    __slots__ = ("noted", "read")

    def __init__(self, read: Callable[[], int]) -> None:
        self.noted: list[int] = []
        self.read = read


class Functions(Protocol):
    """What the simulator calls for a model; `confluent` is None for internal, then external."""

    @property
    def output(self) -> Callable[[], None]:
        """Send; must not change the state."""

    @property
    def internal(self) -> Callable[[], None]:
        """The time advance ran out."""

    @property
    def external(self) -> Callable[[int], None]:
        """Input, so many ns after the last transition."""

    @property
    def confluent(self) -> Callable[[], None] | None:
        """Both at once."""


Instrument: TypeAlias = Callable[[Atomic, Functions], Functions]
"""Given a model and what is called for it, what to call instead."""


class Wrapped:
    """Functions of a model, each as it is or with something around it.

    No dataclass: importing those takes longer than importing the whole formalism.
    """

    __slots__ = ("atomic", "confluent", "external", "internal", "output")

    def __init__(
        self,
        atomic: Atomic,
        output: Callable[[], None],
        internal: Callable[[], None],
        external: Callable[[int], None],
        confluent: Callable[[], None] | None,
    ) -> None:
        self.atomic = atomic
        self.output = output
        self.internal = internal
        self.external = external
        self.confluent = confluent


def bind(
    atomics: Sequence[Atomic], instruments: Sequence[Instrument]
) -> tuple[list[Atomic | Functions], dict[int, Callable[[], None]]]:
    """What to call for each model, and those confluent functions that are not the default one."""
    models: list[Atomic | Functions] = list(atomics)
    own_confluents: dict[int, Callable[[], None]] = {}
    for number, atomic in enumerate(atomics):
        confluent = _own_confluent(atomic)
        if instruments or _computes_time_advance(atomic):
            plain = Wrapped(atomic, atomic.output, atomic.internal, atomic.external, confluent)
            functions = _watched(atomic, plain, instruments)
            confluent = functions.confluent
            if functions is not plain:
                models[number] = functions
        if confluent is not None:
            own_confluents[number] = confluent
    return models, own_confluents


def _own_confluent(atomic: Atomic) -> Callable[[], None] | None:
    return None if type(atomic).confluent is Atomic.confluent else atomic.confluent


def _computes_time_advance(atomic: Atomic) -> bool:
    return type(atomic).time_advance is not Atomic.time_advance


def _watched(atomic: Atomic, plain: Functions, instruments: Sequence[Instrument]) -> Functions:
    """The model's functions with each instrument around them, the first one innermost."""
    functions = plain
    if _computes_time_advance(atomic):
        functions = _asking_time_advance(atomic)
    for instrument in instruments:
        functions = instrument(atomic, functions)
    return functions


def _asking_time_advance(atomic: Atomic) -> Wrapped:
    """For a computed time advance: call it after each transition, keep the result in sigma."""

    def internal() -> None:
        atomic.internal()
        atomic.sigma = atomic.time_advance()

    def external(elapsed: int) -> None:
        atomic.external(elapsed)
        atomic.sigma = atomic.time_advance()

    def confluent() -> None:
        atomic.confluent()
        atomic.sigma = atomic.time_advance()

    return Wrapped(atomic, atomic.output, internal, external, confluent)
