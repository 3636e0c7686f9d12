"""The simulator: Parallel DEVS on a flat model.

How it works. `wiring` has turned the tree into a numbered list of atomics, and `delivery` has tied
each output port to the bags its values end in. An instant is worked off in rounds:

1. every imminent model's output function runs, in order of declaration; bags fill up;
2. every imminent model has its internal transition, or its confluent one if its bags hold
   something; then every other model that was reached has its external transition, each in order
   of declaration;
3. models whose new time advance is zero are the imminent ones of the next round at the same
   instant, without passing through the agenda; the others are booked there.

`advance` takes one instant, `run` one after the other; both are quicker about those at which one
model alone is imminent, the more so if it reaches no other. Waiting in between (none in virtual
time, the executive's in real time) is not this module's business. Instants are integers, so
simultaneity is equality.

A round is written out in one function, with a loop for each of these: most rounds have one model
or two, and calls between its parts would take as long as what they do. The loops recognise a zero
time advance, the commonest, by identity: every zero is one object in CPython, and one that is not
would still be right, only slower, through the agenda.
"""

from collections.abc import Iterable

from firmware_runtime.devs.agenda import NO_MODEL
from firmware_runtime.devs.delivery import Delivery
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import NEVER, ZERO
from firmware_runtime.devs.wiring import Feed


class Simulator(Engine):
    """Runs a model as Parallel DEVS: bags, confluent transitions, all imminent models at once."""

    def _connect(self, feeds: Iterable[Feed]) -> None:
        self._delivery = Delivery(self._numbers, feeds)

    def _initialize(self) -> None:
        self.round = 0
        """Which round of the present instant is under way, from 0; a listener may read it."""
        self.involved: set[int] | None = None
        """If set, gets the number of each model that is to have a transition, until cleared."""
        super()._initialize()
        agenda, delivery = self._agenda, self._delivery
        bookings = self.last_at, agenda, agenda.due_at
        functions = self._models, delivery.marks
        used = delivery.used_fan_outs
        self._transits = *functions, *bookings, self.own_confluents, delivery.pools, used
        """What the transitions of a round begin with."""

    def _run_alone(self, until: int) -> bool:  # noqa: C901, PLR0912 -- written out, see above
        """Take instants as long as one model alone is imminent; return whether there was one.

        Such an instant needs no sorting, and, if the model reaches no other, no rounds: its pair in
        the agenda is replaced. With values injected and not yet delivered there is none.
        """
        agenda, models, last, involved = self._agenda, self._models, self.last_at, self.involved
        reached, alone_at, rebook = self._delivery.reached, agenda.alone_at, agenda.rebook_first
        if reached:
            return False
        taken, number, transitions = False, NO_MODEL, 0
        try:
            while True:  # CPython 3.11 would not specialize a loop with a condition here
                number = alone_at(until)
                if number == NO_MODEL:
                    return taken
                taken = True
                at = self.now = agenda.due_at[number]
                model = models[number]
                self.sending = number
                model.output()
                self.sending = NO_MODEL
                if reached:
                    imminent = agenda.take_first(number)
                    self._work_off(at, self._transit(at, imminent, reached), rounds=1)
                    if at == until:  # as it is for `advance`
                        return True
                else:
                    if involved is not None:
                        involved.add(number)
                    model.internal()
                    last[number] = at
                    transitions += 1
                    sigma = model.sigma
                    if type(sigma) is not int or sigma < 0:
                        sigma = self._whole_time_advance(number)
                    if sigma > 0:
                        rebook(number, at + sigma)
                    else:
                        self._work_off(at, agenda.take_first(number), rounds=1)
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
        finally:
            self.internal_transitions += transitions

    def _work_off(self, at: int, imminent: list[int], rounds: int = 0) -> None:
        reached, models, number = self._delivery.reached, self._models, NO_MODEL
        try:
            while imminent or reached:
                if rounds == self._zero_time_limit:
                    self._refuse_endless_loop(imminent)
                self.round = rounds
                rounds += 1
                for number in imminent:
                    self.sending = number
                    models[number].output()
                self.sending = NO_MODEL
                imminent = self._transit(at, imminent, reached)
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
        self.round = 0

    def _transit(  # noqa: C901, PLR0912, PLR0915 -- written out, see above
        self, at: int, imminent: list[int], reached: list[int]
    ) -> list[int]:
        """The transitions of a round; returns the imminent models of the next, in order."""
        models, marks, last, agenda, due_at, own_confluents, pools, used = self._transits
        if pools:
            self._delivery.pour()
        if self.involved is not None:
            self.involved.update(imminent, reached)
        self.internal_transitions += len(imminent)
        self.external_transitions += len(reached)
        following: list[int] = []
        number = unreached = 0
        try:
            for number in imminent:  # internal and confluent transitions
                model, mark = models[number], marks[number]
                if not mark:
                    unreached += 1
                    model.internal()
                else:
                    if own_confluents and number in own_confluents:
                        own_confluents[number]()
                    else:
                        model.internal()
                        model.external(0)
                    mark.clear()
                last[number] = at
                sigma = model.sigma
                if sigma is ZERO:
                    following.append(number)
                elif sigma is NEVER:
                    pass
                elif type(sigma) is not int or sigma < 0:
                    self._book_oddly_typed(number, at, following)
                else:
                    due = at + sigma
                    if due == agenda.open_at:  # as `book` would, without the call
                        due_at[number] = due
                        agenda.open.append(number)
                    else:
                        agenda.book(number, due)
            if len(imminent) - unreached < len(reached):  # else all of them were confluent
                if len(reached) > 1:
                    reached.sort()
                for number in reached:  # external transitions
                    model, mark = models[number], marks[number]
                    if not mark:  # it was confluent
                        continue
                    model.external(at - last[number])
                    mark.clear()
                    last[number] = at
                    sigma = model.sigma
                    if sigma is ZERO:
                        due_at[number] = NEVER
                        following.append(number)
                    elif sigma is NEVER:
                        due_at[number] = NEVER
                    elif type(sigma) is not int or sigma < 0:
                        self._book_oddly_typed(number, at, following)
                    else:
                        agenda.book(number, at + sigma)
                if len(following) > 1:
                    following.sort()
            reached.clear()
            if used:
                self._delivery.release()
        except ModelError:
            raise
        except Exception as error:
            raise self._failure(number, error) from error
        return following

    def _book_oddly_typed(self, number: int, at: int, following: list[int]) -> None:
        """What both loops do with a time advance that is no `int`, such as one of numpy's."""
        sigma = self._whole_time_advance(number)
        if sigma > 0:
            self._agenda.book(number, at + sigma)
        else:
            self._agenda.due_at[number] = NEVER
            following.append(number)
