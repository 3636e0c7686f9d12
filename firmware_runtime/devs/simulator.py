"""The simulator: Parallel DEVS on a flat model.

How it works. `wiring` has turned the tree into a numbered list of atomics, and each output port is
connected to the bags its values end in. An instant is worked off in rounds:

1. every imminent model's output function runs, in order of declaration; bags fill up, and the
   number of each model that gets its first value joins those that are reached;
2. every imminent model has its internal transition, or its confluent one if it was reached; then
   every other model that was reached has its external transition, each in order of declaration;
3. models whose new time advance is zero are the imminent ones of the next round at the same
   instant, without passing through the agenda; the others are booked there.

`advance` takes one instant, `run` one after the other. Waiting in between (none in virtual time,
the executive's in real time) is not this module's business. Instants are integers, so simultaneity
is equality.

An instant is written out in two functions, bookings included: most rounds have one model or two,
and calls between the parts would take as long as what they do. Each function of a model is called,
noted if that is asked for (`functions.Laps`), and its bags are emptied; `_marks` has for each model
what is true while it has input: its one bag, or a list of those of several that are filled. A zero
time advance, the commonest, is recognised by identity: every zero is one object in CPython, and one
that is not would still be right, only slower.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from heapq import heappop, heappush
from typing import Any

from firmware_runtime.devs.agenda import NO_MODEL
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.engine import ZERO_TIME_LIMIT, Engine
from firmware_runtime.devs.finite import check_of, check_of_all
from firmware_runtime.devs.functions import (
    CONFLUENT,
    EXTERNAL,
    EXTERNAL_OF_BOTH,
    INTERNAL,
    INTERNAL_OF_BOTH,
    OUTPUT,
    Instrument,
    Laps,
)
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import Check, InPort
from firmware_runtime.devs.time import NEVER, ZERO
from firmware_runtime.devs.wiring import Ends, Feed


class Pool(list[Any]):
    """The values that a round has brought for several bags, which the very same ports feed."""

    def __init__(self, bags: Sequence[InPort[Any]], register: list[Any]) -> None:
        super().__init__()
        self.bags = bags
        self.register = register
        self.entry = self


def pools(feeds: Sequence[Feed], register: list[Any]) -> list[Pool]:
    """The pools worth having: where several ports feed the same several bags, each once.

    As in layers of models coupled all to all. Each value then goes into one list, and not into all.
    Bags of a pool take the same values.
    """
    fed: defaultdict[InPort[Any], list[int]] = defaultdict(list)
    if sum(len(ends) > 1 for _, ends in feeds) < 2:
        return []
    for number, (_, ends) in enumerate(feeds):
        for end in ends:
            fed[end].append(number)
    alike: defaultdict[tuple[Check | int | None, ...], list[InPort[Any]]] = defaultdict(list)
    for bag, numbers in fed.items():
        if 1 < len(numbers) == len(set(numbers)):
            alike[check_of(bag), *numbers].append(bag)
    return [Pool(bags, register) for bags in alike.values() if len(bags) > 1]


def _with(pool_of: Mapping[InPort[Any], Pool], ends: Ends) -> list[Any]:
    """These ends, with each pool once in the place of its bags."""
    return [
        pool_of.get(end, end) for end in ends if end not in pool_of or end is pool_of[end].bags[0]
    ]


class Simulator(Engine):
    """Runs a model as Parallel DEVS: bags, confluent transitions, all imminent models at once.

    `laps` gets an entry for each function that was called.
    """

    def __init__(
        self,
        root: Component,
        *,
        checked: bool | None = None,
        instruments: Sequence[Instrument] = (),
        zero_time_limit: int = ZERO_TIME_LIMIT,
        laps: Laps | None = None,
    ) -> None:
        self.round = 0
        """Which round of the present instant is under way, from 0; a listener may read it."""
        self._laps = Laps(int) if laps is None else laps
        self._noted = None if laps is None else laps.noted
        self._reached: list[int] = []
        self._filled: list[InPort[Any]] = []
        self._pools: list[Pool] = []
        super().__init__(
            root, checked=checked, instruments=instruments, zero_time_limit=zero_time_limit
        )

    def _initialize(self) -> None:
        self._parts = (
            *(self.agenda.heap, self.agenda.due_at, self._models, self.atomics, self._marks),
            *(self.last_at, self._reached, self._filled),
        )
        super()._initialize()

    def _connect(self, feeds: Iterable[Feed]) -> None:
        self._marks: list[list[Any]] = []
        for number, atomic in enumerate(self.atomics):
            bags = list(atomic.in_ports.values())
            is_one = len(bags) == 1
            for bag in bags:
                bag.register, bag.entry = (self._reached, number) if is_one else (self._filled, bag)
            self._marks.append(bags[0] if is_one else [])
        feeds = list(feeds)
        pool_of = {bag: pool for pool in pools(feeds, self._pools) for bag in pool.bags}
        for port, ends in feeds:
            number = self._numbers.get(port.owner, NO_MODEL)
            places = ends if not pool_of else _with(pool_of, ends)
            port.connect(self, number, places, check_of_all(port, ends))

    def advance(self, at: int) -> None:  # noqa: C901, PLR0912, PLR0915 -- in one frame, see above
        """As `Engine.advance`."""
        heap, due_at, models, atomics, marks, last_at, reached, filled = self._parts
        confluents, noted, read = self.own_confluents, self._noted, self._laps.read
        left = NEVER - at
        if heap[0][0] < at or not self.now <= at < NEVER:
            self._check_instant(at)
        self.visit = self.visit + 1 if at == self.now else 0
        self.now = at
        if self._injected:
            self._send_injected()
        imminent: list[int] = []
        while heap[0][0] <= at:  # as `Agenda.take`
            instant, number = heappop(heap)
            if due_at[number] == instant:
                due_at[number] = NEVER
                imminent.append(number)
        number = rounds = 0
        try:
            while imminent or reached or filled or self._pools:
                self.round = rounds
                rounds += 1
                if rounds > self._zero_time_limit:
                    self._refuse_endless_loop(imminent)
                for number in imminent:
                    self.sending = number
                    models[number].output()
                    if noted is not None:
                        noted += number, OUTPUT, read(), 0
                self.sending = NO_MODEL
                if self._pools:
                    self._pour()
                for bag in filled:  # a mark is true while there is input, so each is reached once
                    mark = marks[bag.model]
                    if not mark:
                        reached.append(bag.model)
                    mark.append(bag)
                self.internal_transitions += len(imminent)
                following: list[int] = []
                for number in imminent:
                    model, mark = models[number], marks[number]
                    if not mark:
                        model.internal()
                        function = INTERNAL
                    else:
                        if number in confluents:
                            confluents[number]()
                            function = CONFLUENT
                        else:
                            model.internal()
                            if noted is not None:
                                noted += number, INTERNAL_OF_BOTH, read(), atomics[number].sigma
                            model.external(0)
                            function = EXTERNAL_OF_BOTH
                        mark.clear()
                    last_at[number] = at
                    sigma = atomics[number].sigma
                    if noted is not None:
                        noted += number, function, read(), sigma
                    if sigma is ZERO:
                        following.append(number)
                    elif sigma is NEVER:
                        pass
                    elif type(sigma) is int and 0 < sigma < left:  # as `Agenda.book`
                        due_at[number] = due = at + sigma
                        heappush(heap, (due, number))
                    else:
                        self._book_oddly_typed(number, at, following)
                if reached:
                    self._read_input(at, following)
                imminent = following
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
        self.round = 0
        instant, number = heap[0]
        while due_at[number] != instant and number != NO_MODEL:  # as `Agenda.next_at`
            heappop(heap)
            instant, number = heap[0]
        if len(heap) > self.agenda.most:
            self.agenda.drop_stale()

    def _read_input(self, at: int, following: list[int]) -> None:  # noqa: C901 -- as `advance`
        """Call the external transitions of a round; those imminent at once join `following`."""
        heap, due_at, models, atomics, marks, last_at, reached, filled = self._parts
        noted, read, left, number = self._noted, self._laps.read, NEVER - at, NO_MODEL
        self.external_transitions += len(reached)
        reached.sort()
        try:
            for number in reached:
                mark = marks[number]
                if not mark:  # it was confluent
                    continue
                models[number].external(at - last_at[number])
                mark.clear()
                last_at[number] = at
                sigma = atomics[number].sigma
                if noted is not None:
                    noted += number, EXTERNAL, read(), sigma
                if sigma is ZERO:
                    due_at[number] = NEVER
                    following.append(number)
                elif sigma is NEVER:
                    due_at[number] = NEVER
                elif type(sigma) is int and 0 < sigma < left:  # as `Agenda.book`
                    if due_at[number] != at + sigma:
                        due_at[number] = due = at + sigma
                        heappush(heap, (due, number))
                else:
                    self._book_oddly_typed(number, at, following)
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
        reached.clear()
        following.sort()
        if filled:
            for bag in filled:
                bag.clear()
            filled.clear()

    def _pour(self) -> None:
        """Pour pools into their bags."""
        for pool in self._pools:
            for bag in pool.bags:
                if not bag:
                    bag.register.append(bag.entry)
                bag.extend(pool)
            pool.clear()
        self._pools.clear()

    def _book_oddly_typed(self, number: int, at: int, following: list[int]) -> None:
        """Book a model whose time advance is no `int`, such as one of numpy's."""
        sigma = self._whole_time_advance(number)
        if sigma > 0:
            self.agenda.book(number, at + sigma)
        else:
            self.agenda.due_at[number] = NEVER
            following.append(number)
