"""A simulator that lets recorded values enter at their instant, visit and round.

How it works. In the whole model a value may cross the cut in any round of an instant, after zero
time in other components. Here a round takes place up to the last in which something entered, be
there anything imminent or not, so the part's own models are imminent in the rounds they were in.
Within a round a recorded value is sent where its sender stood in the order of declaration: before
what models of the part that are declared after it send, and after those before it.
"""

from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import Any, NamedTuple

from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.simulator import Simulator


class Entry(NamedTuple):
    """One value to enter: in which round, after how many models of the part, where, and what."""

    round: int
    position: int
    port: InPort[Any]
    value: Any


class Player(Simulator):
    """Runs a part of a model; `play` is an `advance` in which recorded values enter."""

    _entries: dict[int, list[Entry]]
    _rounds = 0

    def play(self, at: int, entries: Sequence[Entry]) -> None:
        """Work off instant `at` with these values; not before `now`, nor past `next_at`.

        Raises ModelError for another instant, and for a value that its port does not carry.
        """
        if not self.now <= at <= self.next_at:
            raise ModelError(f"{self.root.path}: cannot play at {at} ns; expected {self.now} on")
        for entry in entries:
            self.check_input(entry.port, entry.value)
        self._entries = {}
        for entry in sorted(entries, key=attrgetter("round", "position")):
            self._entries.setdefault(entry.round, []).append(entry)
        self._rounds = max(self._entries, default=-1) + 1
        if self._rounds > self._zero_time_limit:
            raise ModelError(f"{self.root.path}: round {self._rounds - 1}, expected fewer")
        self.visit = self.visit + 1 if at == self.now else 0
        self.now = at
        try:
            self._work_off(at, self._agenda.take(at))
        finally:
            self._rounds = 0

    def _work_off(self, at: int, imminent: list[int], rounds: int = 0) -> None:
        if self._rounds == 0:
            super()._work_off(at, imminent, rounds)
            return
        reached = self._delivery.reached
        while imminent or reached or rounds < self._rounds:
            if rounds == self._zero_time_limit + self._rounds:
                self._refuse_endless_loop(imminent)
            self.round = rounds
            self._send_between(imminent, iter(self._entries.get(rounds, ())))
            rounds += 1
            imminent = self._transit(at, imminent, reached)
        self.round = 0

    def _send_between(self, imminent: list[int], entries: Iterator[Entry]) -> None:
        """The output functions of a round, with recorded values in their places among them."""
        entry = next(entries, None)
        for number in imminent:
            while entry is not None and entry.position <= number:
                self._entrances[entry.port].send(entry.value)
                entry = next(entries, None)
            self._send(number)
        while entry is not None:
            self._entrances[entry.port].send(entry.value)
            entry = next(entries, None)

    def _send(self, number: int) -> None:
        try:
            self._models[number].output()
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
