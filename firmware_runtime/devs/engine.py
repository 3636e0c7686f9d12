"""What the parallel and the classic simulator share: the flat model, its agenda, its entrances."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from heapq import heappop
from typing import Any, NoReturn, TypeVar

from firmware_runtime.devs.agenda import NO_MODEL, Agenda
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.checked import StateCheck
from firmware_runtime.devs.collection import no_collection
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.finite import Refuse, takes
from firmware_runtime.devs.functions import Instrument, Wrapped, bind
from firmware_runtime.devs.model_errors import (
    IllegitimateModel,
    ModelError,
    ModelFailure,
    PortTypeError,
    SentOutsideOutput,
    TimeAdvanceError,
)
from firmware_runtime.devs.ports import (
    AnyPort,
    Bag,
    InPort,
    Listener,
    Listening,
    OutPort,
    Owner,
    carries,
)
from firmware_runtime.devs.time import NEVER, format_time, kept, whole
from firmware_runtime.devs.wiring import Feed, Wiring, sources_of
from firmware_runtime.errors import text_of

T = TypeVar("T")

ZERO_TIME_LIMIT = 100_000
"""Steps at one instant after which a model counts as illegitimate."""
_COUNTED = ("now", "visit", "internal_transitions", "external_transitions")


class Engine(ABC):
    """A flat model ready to run from time zero; `now` is the instant worked off last, in ns.

    `instruments` may wrap each model's functions. A send outside an output function and a value of
    another type than its port's are errors; with `checked` so is an output function that changes
    its model's state; with `checked=False`, for real time, none of these is looked for.
    `own_confluents` are those functions by number of the models that define one.
    `internal_transitions` and `external_transitions` count; a confluent transition is one of each.
    After an error the run is over: only `exit` may follow.
    """

    def __init__(
        self,
        root: Component,
        *,
        checked: bool | None = None,
        instruments: Sequence[Instrument] = (),
        zero_time_limit: int = ZERO_TIME_LIMIT,
    ) -> None:
        self.root = root
        self.now = 0
        self.visit = -1
        """Which advance to the present instant is under way, from 0; a listener may read it."""
        self.on_refused: Refuse | None = None
        """Called with a port and a value that it did not take, as it is not finite."""
        self.internal_transitions = 0
        self.external_transitions = 0
        self._zero_time_limit = zero_time_limit
        with no_collection():
            self._flatten(root, checked, instruments)
            self._initialize()

    def _flatten(
        self,
        root: Component,
        checked: bool | None,  # noqa: FBT001 -- handed on
        instruments: Sequence[Instrument],
    ) -> None:
        """Number the atomics, connect their ports, and bind their functions."""
        wiring = Wiring(root)
        self.atomics = tuple(wiring.atomics)
        self._numbers: dict[Owner, int] = {
            atomic: number for number, atomic in enumerate(self.atomics)
        }
        self._entrances: dict[InPort[Any], OutPort[Any]] = {
            entry: OutPort(root, entry.name, entry.type) for entry in root.in_ports.values()
        }
        self._injected: list[tuple[OutPort[Any], object]] = []
        self.sending = NO_MODEL
        """The number of the model whose output function is under way: only it may send."""
        for number, atomic in enumerate(self.atomics):
            for bag in atomic.in_ports.values():
                bag.clear()
                bag.model = number
        self._connect(self._feeds(wiring))
        if checked is not False:
            for port in self._out_ports():
                if port.leads_somewhere or checked:
                    port.check_sends()
        if checked:
            instruments = (*instruments, StateCheck(self))
        self._models, self.own_confluents = bind(self.atomics, instruments)
        self.last_at = [0] * len(self.atomics)
        """When each model had its last transition, by number."""
        self.agenda = Agenda(len(self.atomics))

    def _feeds(self, wiring: Wiring) -> Iterator[Feed]:
        """Where the atomics' output ports lead, and the entrances of the root's input ports."""
        for atomic in self.atomics:
            for port in atomic.out_ports.values():
                yield port, wiring.ends(port)
        for entry, entrance in self._entrances.items():
            yield entrance, [entry] if isinstance(self.root, Atomic) else wiring.ends(entry)

    def _out_ports(self) -> Iterator[OutPort[Any]]:
        return (port for atomic in self.atomics for port in atomic.out_ports.values())

    def _initialize(self) -> None:
        number, book = 0, self.agenda.book
        try:
            for number, atomic in enumerate(self.atomics):
                atomic.initialize()
                atomic.sigma = atomic.time_advance()
                sigma = self._whole_time_advance(number)
                if sigma != NEVER:
                    book(number, sigma)
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error

    # What a loop around it needs ----------------------------------------------------------------

    @property
    def next_at(self) -> int:
        """The instant of the next internal event, or NEVER."""
        return self.agenda.next_at()

    def inject(self, port: InPort[T], value: T) -> None:
        """Put one value into an input port of the root; it arrives with the next `advance`."""
        self.check_input(port, value)
        self._injected.append((self._entrances[port], value))

    def check_input(self, port: InPort[T], value: T) -> None:
        """Raise ModelError unless the port is an input of the root that carries such a value."""
        if port not in self._entrances:
            shown = getattr(port, "path", repr(port))
            raise ModelError(f"not an input port of {self.root.path}", where=shown)
        if not carries(port.type, type(value)):
            raise PortTypeError(self.root.path, self.now, _wrong_type(port, value))

    @abstractmethod
    def advance(self, at: int) -> None:
        """Work off instant `at`: inputs, and what is due. Not before `now`, not past `next_at`.

        An instant may be advanced to again, for inputs that arrive in the same nanosecond.
        """

    def _check_instant(self, at: int) -> None:
        next_at = self.agenda.next_at()  # which drops what is left behind
        if not (self.now <= at <= next_at and at < NEVER):
            raise ModelError(
                f"cannot advance to {format_time(at)}",
                where=self.root.path,
                expected=f"an instant from {format_time(self.now)} (now) to "
                f"{format_time(next_at)} (next event)",
            )

    def run(self, until: int) -> None:
        """Take every instant from `now` up to and including `until`, without waiting in between.

        `until` is an instant, not a duration; one before `now` is refused.
        """
        if until < self.now:
            raise ModelError(
                f"cannot run to {format_time(until)}, expected an instant from "
                f"{format_time(self.now)} (now) on; the end of a run is an instant, "
                "not a duration",
                where=self.root.path,
            )
        heap, due_at, advance = self.agenda.heap, self.agenda.due_at, self.advance
        advance(self.now)
        until = min(until, NEVER - 1)
        while heap[0][0] <= until:  # as `Agenda.next_at`
            at, model = heap[0]
            if due_at[model] == at:
                advance(at)
            else:
                heappop(heap)

    @property
    def booked_at(self) -> list[int]:
        """When each model's next internal event is due, by number; NEVER where none is."""
        return self.agenda.due_at

    def state(self) -> dict[str, Any]:
        """What it keeps between two advances, of plain values; the models have their own."""
        counted = {name: getattr(self, name) for name in _COUNTED}
        return counted | {"last_at": list(self.last_at), "due_at": list(self.booked_at)}

    def restore(self, state: dict[str, Any]) -> None:
        """Be where that was. Raises ValueError for the state of another model."""
        last_at, due_at = state["last_at"], state["due_at"]
        if not len(last_at) == len(due_at) == len(self.atomics):
            raise ValueError(f"{len(last_at)} models; expected {len(self.atomics)}")
        for name in _COUNTED:
            setattr(self, name, kept(state[name]))
        self.last_at[:] = map(kept, last_at)
        self.agenda.restore([*map(kept, due_at)])

    def due_at(self, atomic: Atomic) -> int:
        """The instant of the model's next internal event, or NEVER."""
        return self.agenda.due_at[self._number(atomic)]

    def postpone(self, atomic: Atomic, at: int) -> None:
        """Let the model hold its phase until the later instant `at`; `sigma` becomes as long."""
        due_at = self.due_at(atomic)
        if not due_at <= at < NEVER:
            raise ModelError(
                f"cannot postpone its event to {format_time(at)}",
                where=atomic.path,
                expected=f"an instant from {format_time(due_at)} (its due time) on",
            )
        number = self._number(atomic)
        atomic.sigma = at - self.last_at[number]
        self.agenda.book(number, at)

    def listen(self, port: InPort[T] | OutPort[T], listener: Listener[T]) -> Listening:
        """Call `listener(now, value)` for all that leaves by an output port of any model.

        Of an input port for all that comes there.

        Listeners are called after a value was sent on, in the order in which they were added. What
        is returned ends it. Raises ModelError for what is no port.
        """
        if not isinstance(port, InPort | OutPort):
            raise ModelError("expected a port to listen to", where=f"{port!r}")
        if not callable(listener):
            raise ModelError(f"listener {listener!r}: expected a function", where=port.path)
        senders = [self._sender(source) for source in sources_of(port, self._entrances)]
        return Listening(listener, senders, self)

    def exit(self) -> list[Exception]:
        """Call every model's `exit`, last declared first; return what they raised."""
        failures: list[Exception] = []
        for atomic in reversed(self.atomics):
            try:
                atomic.exit()
            except BaseException as error:  # noqa: BLE001 -- the others must still exit
                fault = f"its exit raised {type(error).__name__}: {text_of(error)}"
                failures.append(ModelFailure(atomic.path, self.now, fault))
                failures[-1].__cause__ = error
        return failures

    @contextmanager
    def watched(self, instrument: Instrument) -> Iterator[None]:
        """Within the block, between two advances, call every model through another instrument."""
        models, confluents = list(self._models), dict(self.own_confluents)
        try:
            for number, atomic in enumerate(self.atomics):
                each = models[number]
                own = each.output, each.internal, each.external, confluents.get(number)
                watched = instrument(atomic, Wrapped(atomic, *own))
                self._models[number] = watched
                if number in confluents and watched.confluent is not None:
                    self.own_confluents[number] = watched.confluent
            yield
        finally:
            self._models[:] = models
            self.own_confluents.update(confluents)

    # What the two kinds of simulator fill in or use ---------------------------------------------

    @abstractmethod
    def _connect(self, feeds: Iterable[Feed]) -> None:
        """Let each output port feed its input ports, whose bags are empty."""

    def _send_injected(self) -> None:
        """Send what was injected, now that it is the instant at which it arrives."""
        for entrance, value in self._injected:
            entrance.send(value)
        self._injected.clear()

    def _sender(self, port: AnyPort) -> OutPort[Any]:
        """What sends the values of a port: of an atomic itself, for an input port its entrance."""
        if isinstance(port, InPort):
            return self._entrances[port]
        self._number(port.owner)
        return port

    def _number(self, model: Owner) -> int:
        if model not in self._numbers:
            raise ModelError(f"not an atomic model in {self.root.path}", where=model.path)
        return self._numbers[model]

    def refuse_sent(self, port: OutPort[Any], value: object) -> NoReturn:
        """Raise SentOutsideOutput, or PortTypeError for what is sent in the output function."""
        if self.sending != port.model:
            fault = f"sent on port {port.name!r} outside its output function"
            raise SentOutsideOutput(port.owner.path, self.now, fault)
        raise PortTypeError(port.owner.path, self.now, _wrong_type(port, value))

    def refuse(self, port: OutPort[Any], value: object) -> Sequence[Bag]:
        """Report the ends of a port that do not take a value; return those that do."""
        taking: list[Bag] = []
        for place in port.ends:
            bags: Sequence[InPort[Any]] = getattr(place, "bags", (place,))
            if takes(bags[0], value):
                taking.append(place)
            elif self.on_refused is not None:
                for bag in bags:
                    self.on_refused(bag, value)
        return taking

    def _whole_time_advance(self, number: int) -> int:
        """The model's time advance if it is a whole number of any type, from then on an `int`."""
        atomic = self.atomics[number]
        sigma = whole(atomic.sigma)
        if sigma is None or sigma < 0:
            self._refuse_time_advance(atomic)
        atomic.sigma = sigma
        return sigma

    def _refuse_time_advance(self, atomic: Atomic) -> NoReturn:
        fault = (
            f"time advance of phase {atomic.phase!r} is {atomic.sigma!r}; "
            "expected a whole number of nanoseconds, zero or more, or NEVER"
        )
        raise TimeAdvanceError(atomic.path, self.now, fault)

    def _refuse_endless_loop(self, imminent: Sequence[int]) -> NoReturn:
        first, *others = (self.atomics[number].path for number in imminent[:3])
        company = f" together with {', '.join(others)}" if others else ""
        fault = (
            f"still imminent{company} after {self._zero_time_limit} steps at this instant; "
            "expected some time advance in the loop to be positive"
        )
        raise IllegitimateModel(first, self.now, fault)

    def _failure(self, number: int, error: Exception) -> ModelFailure:
        atomic = self.atomics[number]
        fault = f"raised {type(error).__name__} in phase {atomic.phase!r}: {text_of(error)}"
        return ModelFailure(atomic.path, self.now, fault)


def _wrong_type(port: AnyPort, value: object) -> str:
    return f"port {port.name!r} carries {port.type.__name__}, not {value!r}"
