"""The simulator: Parallel DEVS on a flat model.

How it works. `wiring` has turned the tree into a numbered list of atomics. Each output port's
`send` is replaced by a closure (`delivery`) that appends straight to the bags it ends in and notes
the first value that reaches a model. An instant is worked off in rounds:

1. every imminent model's output function runs, in order of declaration; bags fill up;
2. every imminent model has its internal transition, or its confluent one if its bags hold
   something; then every other model that was reached has its external transition, each in order
   of declaration;
3. models whose new time advance is zero are the imminent ones of the next round at the same
   instant, without passing through the agenda; the others are booked there.

`advance` takes one instant; `run` takes them one after the other. Who waits in between (nobody in
virtual time, the executive in real time) is not this module's business. Instants are integers, so
simultaneity is equality.
"""

from collections.abc import Iterable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.delivery import Delivery
from firmware_runtime.devs.engine import Engine, Sender
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.time import NEVER


class Simulator(Engine):
    """Runs a model as Parallel DEVS: bags, confluent transitions, all imminent models at once."""

    def _make_sender(self, atomics: Iterable[Atomic]) -> Sender:
        delivery = Delivery(atomics)
        self._reached, self._marks, self._clears = (
            delivery.reached,
            delivery.marks,
            delivery.clears,
        )
        return delivery.sender

    def _work_off(self, at: int, imminent: list[int]) -> None:
        for _ in range(self._zero_time_limit):
            if not imminent and not self._reached:
                return
            imminent = self._round(at, imminent)
        if imminent:
            self._refuse_endless_loop(imminent)

    def _round(self, at: int, imminent: list[int]) -> list[int]:
        """One round; returns the imminent models of the next, in order of declaration."""
        outputs, reached = self._outputs, self._reached
        number = 0
        try:
            for number in imminent:
                outputs[number]()
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
        self.internal_transitions += len(imminent)
        self.external_transitions += len(reached)
        following: list[int] = []
        confluent = self._transit_imminent(at, imminent, following)
        if len(reached) != confluent:
            reached.sort()
            self._transit_reached(at, reached, following)
            following.sort()
        reached.clear()
        return following

    def _transit_imminent(self, at: int, imminent: list[int], following: list[int]) -> int:
        """Internal and confluent transitions; returns the number of the latter."""
        atomics, last, marks, clears = self.atomics, self._last, self._marks, self._clears
        internals, externals, confluents = self._internals, self._externals, self._confluents
        book = self._agenda.book
        number = met = 0
        try:
            for number in imminent:
                if marks[number]:
                    met += 1
                    confluent = confluents[number]
                    if confluent is None:
                        internals[number]()
                        externals[number](0)
                    else:
                        confluent()
                    clears[number]()
                else:
                    internals[number]()
                last[number] = at
                sigma = atomics[number].sigma
                if sigma.__class__ is not int or sigma < 0:
                    self._refuse_time_advance(number)
                if sigma == 0:
                    following.append(number)
                elif sigma != NEVER:
                    book(number, at + sigma)
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
        return met

    def _transit_reached(self, at: int, reached: list[int], following: list[int]) -> None:
        """External transitions of those that have not had a confluent one."""
        atomics, last, marks, clears = self.atomics, self._last, self._marks, self._clears
        externals, due_at, book = self._externals, self._agenda.due_at, self._agenda.book
        number = 0
        try:
            for number in reached:
                if not marks[number]:
                    continue
                externals[number](at - last[number])
                clears[number]()
                last[number] = at
                sigma = atomics[number].sigma
                if sigma.__class__ is not int or sigma < 0:
                    self._refuse_time_advance(number)
                if sigma == 0:
                    due_at[number] = NEVER
                    following.append(number)
                else:
                    book(number, at + sigma)
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
