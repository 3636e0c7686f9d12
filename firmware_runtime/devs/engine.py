"""What the parallel and the classic simulator share: the flat model, its agenda, its entrances."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

from firmware_runtime.devs.agenda import Agenda
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.checked import Checks
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.delivery import Inbox, sender
from firmware_runtime.devs.errors import (
    ModelError,
    ModelFailure,
    ModelTimeError,
    PortTypeError,
    TimeAdvanceError,
)
from firmware_runtime.devs.functions import Instrument, functions_of
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import NEVER, format_time
from firmware_runtime.devs.wiring import resolve

ZERO_TIME_LIMIT = 100_000
"""Steps at one instant after which a model counts as illegitimate."""


class Engine(ABC):
    """A flat model ready to run from time zero; `now` is the instant worked off last, in ns.

    `instruments` may wrap each model's functions. With `checked`, an output function that changes
    its model's state, a send outside an output function, and a value of another type than its
    port's are errors too. `internal_transitions` and `external_transitions` count; a confluent
    transition is one of each.
    """

    def __init__(
        self,
        root: Component,
        *,
        checked: bool = False,
        instruments: Sequence[Instrument] = (),
        zero_time_limit: int = ZERO_TIME_LIMIT,
    ) -> None:
        self.root = root
        self.now = 0
        self.internal_transitions = 0
        self.external_transitions = 0
        self._zero_time_limit = zero_time_limit
        self._wire(root)
        checks = (Checks(self),) if checked else ()
        functions = [functions_of(each, (*instruments, *checks)) for each in self.atomics]
        self._outputs = [each.output for each in functions]
        self._internals = [each.internal for each in functions]
        self._externals = [each.external for each in functions]
        self._confluents = [each.confluent for each in functions]
        self._last = [0] * len(self.atomics)
        self._agenda = Agenda(len(self.atomics))
        self._initialize()

    def _wire(self, root: Component) -> None:
        wiring = resolve(root)
        self.atomics = wiring.atomics
        self._numbers = {atomic: number for number, atomic in enumerate(self.atomics)}
        inbox_of: dict[Component, Inbox] = {
            atomic: Inbox(number, atomic) for atomic, number in self._numbers.items()
        }
        self._marks = [inbox.mark for inbox in inbox_of.values()]
        self._clears = [inbox.clear for inbox in inbox_of.values()]
        self._reached: list[int] = []
        self._entrances: dict[InPort[object], Callable[[object], None]] = {}
        for port, ends in wiring.ends.items():
            send = sender(ends, inbox_of, self._reached.append)
            if isinstance(port, OutPort):
                port.send = send
            else:
                self._entrances[port] = send

    def _initialize(self) -> None:
        for number, atomic in enumerate(self.atomics):
            try:
                atomic.initialize()
                atomic.sigma = atomic.time_advance()
                if type(atomic.sigma) is not int or atomic.sigma < 0:
                    raise self._bad_time_advance(number, 0)
            except Exception as error:
                raise self._failure(number, error) from error
            self._agenda.book(number, atomic.sigma)

    # What a loop around it needs ----------------------------------------------------------------

    @property
    def next_at(self) -> int:
        """The instant of the next internal event, or NEVER."""
        return self._agenda.next_at()

    def inject(self, port: InPort[object], value: object) -> None:
        """Put one value into an input port of the root; the next `advance` delivers it."""
        if port not in self._entrances:
            raise ModelError(f"{port.path}: not an input port of {self.root.path}")
        if not isinstance(value, port.type):
            raise PortTypeError(f"{port.path}: {value!r} is not of type {port.type.__name__}")
        self._entrances[port](value)

    def advance(self, at: int) -> None:
        """Work off instant `at`, not before `now` and not past `next_at`: inputs and what is due."""
        if not self.now <= at <= self.next_at:
            raise ModelError(
                f"{self.root.path}: cannot advance to {format_time(at)}, expected an instant from "
                f"{format_time(self.now)} (now) to {format_time(self.next_at)} (next event)"
            )
        self.now = at
        self._work_off(at, self._agenda.take(at))

    def run(self, until: int) -> None:
        """Take every instant up to and including `until`, without waiting in between."""
        take, work_off = self._agenda.take, self._work_off
        while (at := self._agenda.next_at()) <= until and at != NEVER:
            self.now = at
            work_off(at, take(at))

    def due_at(self, atomic: Atomic) -> int:
        """The instant of the model's next internal event, or NEVER."""
        return self._agenda.due_at[self._numbers[atomic]]

    def postpone(self, atomic: Atomic, at: int) -> None:
        """Move the model's next internal event to a later instant; its state is untouched."""
        self._agenda.book(self._numbers[atomic], at)

    def listen(self, port: OutPort[object], hear: Callable[[int, object], None]) -> None:
        """Call `hear(now, value)` for whatever this port of an atomic, or of the root, sends."""
        send = port.send

        def send_and_tell(value: object) -> None:
            hear(self.now, value)
            send(value)

        port.send = send_and_tell

    def exit(self) -> list[Exception]:
        """Call every model's `exit`, last declared first; return what they raised."""
        failures: list[Exception] = []
        for atomic in reversed(self.atomics):
            try:
                atomic.exit()
            except Exception as error:  # noqa: BLE001 -- the others must still exit
                failures.append(error)
        return failures

    # What the two kinds of simulator fill in or use -----------------------------------------------

    @abstractmethod
    def _work_off(self, at: int, imminent: list[int]) -> None:
        """Do everything that happens at instant `at`; `imminent` in order of declaration."""

    def _bad_time_advance(self, number: int, at: int) -> TimeAdvanceError:
        atomic = self.atomics[number]
        return TimeAdvanceError(
            atomic.path,
            at,
            f"time advance of phase {atomic.phase!r} is {atomic.sigma!r}; "
            "expected a whole number of nanoseconds, zero or more, or NEVER",
        )

    def _failure(self, number: int, error: Exception) -> ModelTimeError:
        if isinstance(error, ModelTimeError):
            return error
        atomic = self.atomics[number]
        fault = f"raised {type(error).__name__} in phase {atomic.phase!r}: {error}"
        return ModelFailure(atomic.path, self.now, fault)

    def _endless_loop(self, imminent: Sequence[int]) -> str:
        paths = ", ".join(self.atomics[number].path for number in imminent[:3])
        return (
            f"more than {self._zero_time_limit} zero-time steps in a row, the last by {paths}; "
            "expected some time advance in the loop to be positive"
        )
