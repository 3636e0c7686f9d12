"""The classic simulator: DEVS with Select, one model at a time.

How it works. At an instant the imminent models are activated one after the other. Which one is
next, the coupled models decide, from the root down: each one's `select` chooses among those of its
components, atomic or coupled, that hold an imminent model; by default the first declared. The
chosen one's output function runs, then its internal transition; then each value it sent travels, in
the order sent and along each wire in the order of declaration, and is an external transition of its
own, with one value in one bag. A receiver that was imminent itself has the external transition with
its full time elapsed, and is imminent from then on if its new time advance is zero. There is no
confluent transition.

A model that is imminent when the instant begins is in its first round; one that becomes imminent
through the transitions of another in one round is in the next. The limit of a zero-time loop is one
of rounds, as in Parallel DEVS, so that many models may well be imminent at one instant.

Values injected from outside arrive first, before any imminent model is activated.
"""

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterable, Sequence

from firmware_runtime.devs.agenda import NO_MODEL
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.finite import check_of_all
from firmware_runtime.devs.model_errors import ModelError, ModelFailure, SelectError
from firmware_runtime.devs.ports import InPort, Owner
from firmware_runtime.devs.time import NEVER
from firmware_runtime.devs.wiring import Feed
from firmware_runtime.errors import text_of


class _Queue:
    """In the place of a bag: puts each value behind those that were sent before."""

    def __init__(self, end: InPort[object], sent: deque[tuple[InPort[object], object]]) -> None:
        self.bags = (end,)
        self._end = end
        self._sent = sent

    def append(self, value: object, /) -> None:
        """Take one value."""
        self._sent.append((self._end, value))


class ClassicSimulator(Engine):
    """Runs a model as classic DEVS: one imminent model at a time, one message at a time."""

    def _connect(self, feeds: Iterable[Feed]) -> None:
        self._sent: deque[tuple[InPort[object], object]] = deque()
        self._lineages = [self._lineage(atomic) for atomic in self.atomics]
        self._round = 0
        self._rounds = [0] * len(self.atomics)
        for port, ends in feeds:
            queues = [_Queue(end, self._sent) for end in ends]
            number = self._numbers.get(port.owner, NO_MODEL)
            port.connect(self, number, queues, check_of_all(port, ends))

    def advance(self, at: int) -> None:
        """As `Engine.advance`."""
        self._check_instant(at)
        self.visit = self.visit + 1 if at == self.now else 0
        self.now = at
        self._send_injected()
        imminent = self.agenda.take(at)
        for number in imminent:
            self._rounds[number] = 0
        self._round = 0
        self._deliver(at, imminent)
        while imminent:
            number = self._select(imminent)
            self._round = self._rounds[number] = self._rounds[number] + 1
            if self._round > self._zero_time_limit:
                self._refuse_endless_loop([number, *(n for n in imminent if n != number)])
            self._activate(number)
            self._reschedule(number, at, imminent)
            self._deliver(at, imminent)

    # One step -----------------------------------------------------------------------------------

    def _activate(self, number: int) -> None:
        model = self._models[number]
        self.internal_transitions += 1
        self.sending = number
        self._call(number, model.output)
        self.sending = NO_MODEL
        self._call(number, model.internal)

    def _deliver(self, at: int, imminent: list[int]) -> None:
        """Hand over what was sent, one value after the other."""
        while self._sent:
            bag, value = self._sent.popleft()
            number = bag.model
            self.external_transitions += 1
            bag.append(value)
            self._call(number, self._models[number].external, at - self.last_at[number])
            bag.clear()
            self._reschedule(number, at, imminent)

    def _call(self, number: int, function: Callable[..., None], *arguments: int) -> None:
        try:
            function(*arguments)
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error

    def _reschedule(self, number: int, at: int, imminent: list[int]) -> None:
        """Read the new time advance; `imminent` stays in order of declaration."""
        self.last_at[number] = at
        sigma = self.atomics[number].sigma
        if type(sigma) is not int or sigma < 0:
            sigma = self._whole_time_advance(number)
        place = bisect_left(imminent, number)
        was_imminent = place < len(imminent) and imminent[place] == number
        if sigma > 0 and was_imminent:
            del imminent[place]
        elif sigma == 0 and not was_imminent:
            imminent.insert(place, number)
            self._rounds[number] = self._round
        self.agenda.book(number, at + sigma if sigma > 0 else NEVER)

    # Select -------------------------------------------------------------------------------------

    def _select(self, imminent: list[int]) -> int:
        """Let the coupled models, from the root down, choose one of the imminent models."""
        candidates, depth = imminent, 0
        while len(candidates) > 1:
            holders = [self._lineages[number][depth] for number in candidates]
            components = tuple(dict.fromkeys(holders))
            if len(components) > 1:
                chosen = self._ask(components)
                candidates = [n for n in candidates if self._lineages[n][depth] is chosen]
            depth += 1
        return candidates[0]

    def _ask(self, components: Sequence[Component]) -> Component:
        """What the coupled model that these are part of selects."""
        coupled = components[0].parent
        assert isinstance(coupled, Coupled)  # noqa: S101 -- the root is no component
        try:
            chosen = coupled.select(components)
        except ModelError:
            raise
        except Exception as error:
            fault = f"its select raised {type(error).__name__}: {text_of(error)}"
            raise ModelFailure(coupled.path, self.now, fault) from error
        if chosen not in components:
            names = ", ".join(component.name for component in components)
            fault = f"its select chose {chosen!r}, expected one of {names}"
            raise SelectError(coupled.path, self.now, fault)
        return chosen

    def _lineage(self, model: Owner | None) -> tuple[Component, ...]:
        """The components that hold an atomic, from below the root down to the atomic itself."""
        lineage: list[Component] = []
        while isinstance(model, Component) and model is not self.root:
            lineage.append(model)
            model = model.parent
        return tuple(reversed(lineage))
