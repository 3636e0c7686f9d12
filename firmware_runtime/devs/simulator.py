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

from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.errors import IllegitimateModel
from firmware_runtime.devs.time import NEVER


class Simulator(Engine):
    """Runs a model as Parallel DEVS: bags, confluent transitions, all imminent models at once."""

    def _work_off(self, at: int, imminent: list[int]) -> None:
        rounds = 0
        while imminent or self._reached:
            if rounds == self._zero_time_limit:
                raise IllegitimateModel(self.root.path, at, self._endless_loop(imminent))
            rounds += 1
            imminent = self._round(at, imminent)

    def _round(self, at: int, imminent: list[int]) -> list[int]:
        """One round; returns the imminent models of the next, in order of declaration."""
        outputs, reached = self._outputs, self._reached
        number = 0
        try:
            for number in imminent:
                outputs[number]()
        except Exception as error:
            raise self._failure(number, error) from error
        self.internal_transitions += len(imminent)
        self.external_transitions += len(reached)
        following: list[int] = []
        self._transit_imminent(at, imminent, following)
        if reached:
            reached.sort()
            self._transit_reached(at, reached, following)
            reached.clear()
            following.sort()
        return following

    def _transit_imminent(self, at: int, imminent: list[int], following: list[int]) -> None:
        atomics, last, marks, clears = self.atomics, self._last, self._marks, self._clears
        internals, externals, confluents = self._internals, self._externals, self._confluents
        book = self._agenda.book
        number = 0
        try:
            for number in imminent:
                if not marks[number]:
                    internals[number]()
                else:
                    confluent = confluents[number]
                    if confluent is None:
                        internals[number]()
                        externals[number](0)
                    else:
                        confluent()
                    clears[number]()
                last[number] = at
                sigma = atomics[number].sigma
                if sigma.__class__ is not int:
                    raise self._bad_time_advance(number, at)
                if sigma == 0:
                    following.append(number)
                elif sigma < 0:
                    raise self._bad_time_advance(number, at)
                elif sigma != NEVER:
                    book(number, at + sigma)
        except Exception as error:
            raise self._failure(number, error) from error

    def _transit_reached(self, at: int, reached: list[int], following: list[int]) -> None:
        atomics, last, marks, clears = self.atomics, self._last, self._marks, self._clears
        externals, due_at, book = self._externals, self._agenda.due_at, self._agenda.book
        number = 0
        try:
            for number in reached:
                if not marks[number]:
                    continue  # it was imminent and has had its confluent transition
                externals[number](at - last[number])
                clears[number]()
                last[number] = at
                sigma = atomics[number].sigma
                if sigma.__class__ is not int:
                    raise self._bad_time_advance(number, at)
                if sigma == 0:
                    due_at[number] = NEVER
                    following.append(number)
                elif sigma < 0:
                    raise self._bad_time_advance(number, at)
                else:
                    book(number, NEVER if sigma == NEVER else at + sigma)
        except Exception as error:
            raise self._failure(number, error) from error
