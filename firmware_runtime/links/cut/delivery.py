"""Delivery of steps that arrive: each enters the model as one event, by each port's rule.

    any port          a value that entered, or waits to, is ignored when it comes again
    most ports        one that is older than the newest that entered was overtaken: it is counted
    an ordered port   one enters after the one that it says it comes after; until that has come, its
                      whole step waits, and what it waits for longer than the timeout is given up

Of several steps that are read together the newest `keep` values of a port enter, but all of an
ordered one. Without I/O: frames and ages in, bags out.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.inbox import Bag
from firmware_runtime.links.cut.counts import Counts
from firmware_runtime.links.cut.cut import Crossing, Terms
from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.cut.window import Seen
from firmware_runtime.links.cut.wire import Entry, Frame, Missing, entries_of

MOST_WAITING: Final = 256
"""How many steps may wait for what comes before them."""

Age: TypeAlias = Callable[[int], int]
"""How long ago an instant of the other end's clock was, ns."""


@dataclass(slots=True, eq=False)
class Entrance:
    """One port at which values enter, and what of it has come."""

    crossing: Crossing
    port: InPort[Any]
    is_ordered: bool
    may_be_old: bool
    seen: Seen = field(default_factory=Seen)
    entered: int = 0
    """The highest sequence that has entered, or was given up."""


@dataclass(slots=True, eq=False)
class Part:
    """Values that came for one port in a step."""

    entrance: Entrance
    sequence: int
    after: int
    values: list[object]


@dataclass(slots=True, eq=False)
class Step:
    """Parts that came of a step."""

    origin: int
    parts: list[Part]

    @property
    def waits(self) -> bool:
        """Return whether something has to enter before it."""
        return any(
            part.after > part.entrance.entered for part in self.parts if part.entrance.is_ordered
        )


class Delivery:
    """`ports` are those at which values enter, by number; `takes_old` as for a link.

    `on_lost` is called with a sentence where something of an ordered port will never come.
    """

    def __init__(
        self,
        ports: Mapping[int, tuple[Crossing, InPort[object]]],
        terms: Terms,
        *,
        takes_old: bool,
        counts: Counts,
        on_lost: Callable[[str], None],
    ) -> None:
        self._counts = counts
        self._terms = terms
        self._on_lost = on_lost
        self._entrances = {
            number: Entrance(
                crossing,
                port,
                crossing.name in terms.ordered,
                takes_old and crossing.name in terms.retain,
            )
            for number, (crossing, port) in ports.items()
        }
        self._waiting: list[Step] = []
        self._ready: list[Step] = []

    def begin_again(self) -> None:
        """There is another peer, which counts from 1."""
        self._waiting.clear()
        for each in self._entrances.values():
            each.seen, each.entered = Seen(), 0

    def lacks(self, missing: Missing) -> str | None:
        """The crossing of which this end has nothing as new as that; None if it has.

        What may be old is not missed.
        """
        entrance = self._entrances.get(missing.port)
        if missing.sequence == 0 or entrance is None or entrance.may_be_old:
            return None
        newest = max(entrance.entered, entrance.seen.highest)
        return entrance.crossing.name if newest < missing.sequence else None

    def take(self, frame: Frame, age: int) -> int:
        """Take a step of this age; of how many ports something is new. Raises Refused.

        Nothing of a step enters if a value in it is none of its port, or outside of its limits.
        """
        is_old = age > self._terms.timeout
        fresh: list[Part] = []
        old: list[Part] = []
        for part in self._parts(entries_of(frame)):
            entrance = part.entrance
            if part.sequence <= entrance.entered:
                entrance.seen.note(part.sequence)
                self._counts.overtaken += len(part.values)
            else:
                (old if is_old and not entrance.may_be_old else fresh).append(part)
        for part in fresh:
            part.entrance.seen.note(part.sequence)
        if fresh:
            self._queue(Step(frame.origin, fresh))
        if old:
            for part in old:  # what comes after it is not to wait for it
                part.entrance.entered = max(part.entrance.entered, part.sequence)
            self._release()
            text = f"{old[0].entrance.crossing.name} was {age / SECOND:.3f} s old"
            raise Refused(Reason.TOO_OLD, text)
        return len(fresh)

    def bags(self, age: Age) -> list[Bag]:
        """The events for the model; what has waited too long is given up."""
        if self._waiting:
            self._give_up(age)
        steps, self._ready = self._ready, []
        if not steps:
            return []
        taken: Counter[int] = Counter()
        bags: list[Bag] = []
        for step in reversed(steps):
            bag = [each for part in step.parts for each in self._values(part, taken)]
            if bag:
                bags.append(bag)
        return bags[::-1]

    # ----------------------------------------------------------------------------------------------

    def _parts(self, entries: list[Entry]) -> list[Part]:
        """Return what has not come before. Raises Refused."""
        for entry in entries:
            if entry.port not in self._entrances:
                raise Refused(Reason.UNKNOWN_PORT, str(entry.port))
        return [
            Part(entrance, entry.sequence, entry.after, entrance.crossing.unpacked(entry.body))
            for entry in entries
            if not (entrance := self._entrances[entry.port]).seen.has(entry.sequence)
        ]

    def _queue(self, step: Step) -> None:
        """Let a step enter, or wait for what comes before it."""
        if step.waits:
            self._waiting.append(step)
            if len(self._waiting) > MOST_WAITING:
                self._skip(self._waiting.pop(0))
        else:
            self._enter(step)
        self._release()

    def _release(self) -> None:
        """Let everything enter that waits for nothing any more."""
        while ready := next((step for step in self._waiting if not step.waits), None):
            self._waiting.remove(ready)
            self._enter(ready)

    def _enter(self, step: Step) -> None:
        kept = []
        for part in step.parts:
            entrance = part.entrance
            if part.sequence <= entrance.entered:  # while its step was waiting
                self._counts.overtaken += len(part.values)
                continue
            if entrance.is_ordered and 0 < entrance.entered < part.sequence - 1:
                lost = part.sequence - 1 - entrance.entered
                self._on_lost(f"{lost} of {entrance.crossing.name} were lost")
            entrance.entered = part.sequence
            kept.append(part)
        if kept:
            self._ready.append(Step(step.origin, kept))

    def _give_up(self, age: Age) -> None:
        """Give up what waits for something that will not come any more."""
        for step in list(self._waiting):
            if step in self._waiting and age(step.origin) > self._terms.timeout:
                self._waiting.remove(step)
                if all(part.entrance.may_be_old for part in step.parts):
                    self._enter(step)
                else:
                    self._skip(step)
        self._release()

    def _skip(self, step: Step) -> None:
        """A step does not enter: what comes after it no longer waits for it."""
        for part in step.parts:
            part.entrance.entered = max(part.entrance.entered, part.sequence)
            self._counts.dropped += len(part.values)
        self._on_lost(f"what came before {step.parts[0].entrance.crossing.name} was lost")

    def _values(self, part: Part, taken: Counter[int]) -> Bag:
        """Return what of a part enters: the newest `keep` of a port; later steps come first."""
        entrance = part.entrance
        number = entrance.crossing.number
        taken[number] += 1
        if taken[number] > self._terms.keep and not entrance.is_ordered:
            self._counts.dropped += len(part.values)
            return []
        self._counts.received += len(part.values)
        return [(entrance.port, value) for value in part.values]
