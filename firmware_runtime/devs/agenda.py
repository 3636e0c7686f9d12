"""The agenda: which models are due at which instant.

A heap of instants and models. Rebooking leaves the old entry behind; it is passed over when its
instant comes, because `due_at` no longer agrees (lazy deletion). When the entries left behind
outnumber the models, all are dropped at once, so a timeout that is always rebooked and never comes
does not fill the memory.

The simulator books and takes in its own frame, as `book` and `take` do.
"""

from heapq import heapify, heappop, heappush

from firmware_runtime.devs.time import NEVER

NO_MODEL = -1
"""In place of a model's number."""
_BOTTOM = (NEVER, NO_MODEL)
"""The last entry, so that a heap always has a first."""
_SPARE = 64
"""Entries beyond two a model that the heap may hold before it is rid of stale ones."""


class Agenda:
    """Bookings of models, by number, at instants in the future; `due_at[i]` is the valid one."""

    def __init__(self, models: int) -> None:
        self.due_at: list[int] = [NEVER] * models
        self.heap: list[tuple[int, int]] = [_BOTTOM]
        """Its first instant is `next_at`, or before that: an entry left behind."""
        self.most = 2 * models + _SPARE
        """Entries that it may have before `drop_stale`."""

    def book(self, model: int, at: int) -> None:
        """Make `at` the one instant at which `model` is due; from NEVER on it is never due."""
        if at >= NEVER:
            self.due_at[model] = NEVER
        elif self.due_at[model] != at:
            self.due_at[model] = at
            heappush(self.heap, (at, model))
            if len(self.heap) > self.most:
                self.drop_stale()

    def next_at(self) -> int:
        """The earliest instant at which a model is due, or NEVER."""
        heap, due_at = self.heap, self.due_at
        at, model = heap[0]
        while at != NEVER and due_at[model] != at:
            heappop(heap)
            at, model = heap[0]
        return at

    def take(self, at: int) -> list[int]:
        """Remove and return the models due at `at`, which is not past `next_at`, in order."""
        heap, due_at = self.heap, self.due_at
        due: list[int] = []
        while heap[0][0] <= at:
            instant, model = heappop(heap)
            if due_at[model] == instant:
                due_at[model] = NEVER
                due.append(model)
        return due

    def restore(self, due_at: list[int]) -> None:
        """Have these bookings in place of those there are."""
        self.due_at[:] = due_at
        self.drop_stale()

    def drop_stale(self) -> None:
        """Be rid of the entries left behind."""
        bookings = [(at, model) for model, at in enumerate(self.due_at) if at != NEVER]
        self.heap[:] = [*bookings, _BOTTOM]
        heapify(self.heap)
