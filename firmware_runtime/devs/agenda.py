"""The agenda: which models are due at which instant.

A heap of pairs: an instant, and models booked for it. Bookings for one instant that follow each
other share a pair, so models with one period cost one heap operation together, not one each.
Rebooking leaves the old entry behind; it is passed over when its instant comes, because `due_at` no
longer agrees (lazy deletion). When the pairs left behind outnumber the models, all are dropped at
once, so a timeout that is always rebooked and never comes does not fill the memory. Two pairs for
never stay at the bottom, so that a heap always has a first place, and the two places under it.
"""

from heapq import heapify, heappop, heappush, heapreplace

from firmware_runtime.devs.time import NEVER

NO_MODEL = -1
"""In place of a model's number."""
_BOTTOM = ((NEVER, [NO_MODEL]), (NEVER, [NO_MODEL]))
_SPARE = 64
"""Pairs beyond two a model that the heap may hold before it is rid of stale ones."""


class Agenda:
    """Bookings of models, by number, at instants in the future; `due_at[i]` is the valid one."""

    def __init__(self, models: int) -> None:
        self.due_at: list[int] = [NEVER] * models
        self._heap: list[tuple[int, list[int]]] = list(_BOTTOM)
        self._most_pairs = 2 * models + _SPARE
        self.open_at = NEVER
        self.open: list[int] = []
        """The models of the newest pair, which is for `open_at`; those not booked may join."""

    def book(self, model: int, at: int) -> None:
        """Make `at` the one instant at which `model` is due; from NEVER on it is never due."""
        if at >= NEVER:
            self.due_at[model] = NEVER
        elif self.due_at[model] != at:
            self.due_at[model] = at
            if at == self.open_at:
                self.open.append(model)
            else:
                self.open_at, self.open = at, [model]
                heappush(self._heap, (at, self.open))
                if len(self._heap) > self._most_pairs:
                    self._drop_stale()

    def alone_at(self, until: int) -> int:
        """The model that is due first, by `until` (not NEVER), and is due alone; or NO_MODEL.

        NO_MODEL may also mean that finding out takes longer: `next_at` and `take` do that.
        """
        heap = self._heap
        at, models = heap[0]
        number = models[0]
        if (
            at > until
            or len(models) > 1
            or self.due_at[number] != at
            or heap[1][0] == at  # what comes next stands in one of these two places
            or heap[2][0] == at
        ):
            return NO_MODEL
        return number

    def rebook_first(self, model: int, at: int) -> None:
        """Reschedule the model that `alone_at` has returned; from NEVER on it is never due."""
        if at >= NEVER:
            self.due_at[model] = NEVER
            self._pop()
        elif at == self.open_at and self._heap[0][1] is not self.open:
            self.due_at[model] = at
            self.open.append(model)
            heappop(self._heap)
        else:
            self.due_at[model] = self.open_at = at
            self.open = [model]
            heapreplace(self._heap, (at, self.open))

    def take_first(self, model: int) -> list[int]:
        """Remove the model that `alone_at` has returned; return it as `take` would."""
        self.due_at[model] = NEVER
        self._pop()
        return [model]

    def next_at(self) -> int:
        """The earliest instant at which a model is due, or NEVER."""
        heap, due_at = self._heap, self.due_at
        while True:
            at, models = heap[0]
            if at >= NEVER:
                return NEVER
            for model in models:
                if due_at[model] == at:
                    return at
            self._pop()

    def take(self, at: int) -> list[int]:
        """Remove and return the models due at `at`, which is not past `next_at`, in order."""
        heap, due_at = self._heap, self.due_at
        due: list[int] = []
        while heap[0][0] <= at:
            instant, models = self._pop()
            for model in models:
                if due_at[model] == instant:
                    due_at[model] = NEVER
                    due.append(model)
        if len(due) > 1:
            due.sort()
        return due

    def restore(self, due_at: list[int]) -> None:
        """Have these bookings in place of those there are."""
        self.due_at[:] = due_at
        self._drop_stale()

    def _pop(self) -> tuple[int, list[int]]:
        pair = heappop(self._heap)
        if pair[1] is self.open:
            self.open_at = NEVER
        return pair

    def _drop_stale(self) -> None:
        bookings = [(at, [model]) for model, at in enumerate(self.due_at) if at != NEVER]
        self._heap[:] = [*bookings, *_BOTTOM]
        heapify(self._heap)
        self.open_at = NEVER
