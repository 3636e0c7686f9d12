"""The agenda: which models are due at which instant.

A heap of pairs: an instant, and models booked for it. Bookings for one instant that follow each
other share a pair, so models with one period cost one heap operation together, not one each.
Rebooking leaves the old entry behind; it is passed over when its instant comes, because `due_at` no
longer agrees (lazy deletion). When the pairs left behind outnumber the models, all are dropped at
once, so a timeout that is always rebooked and never comes does not fill the memory.
"""

from heapq import heappop, heappush

from firmware_runtime.devs.time import NEVER

_SPARE = 64
"""Pairs beyond two a model that the heap may hold before it is rid of stale ones."""


class Agenda:
    """Bookings of models, by number, at instants in the future; `due_at[i]` is the valid one."""

    def __init__(self, models: int) -> None:
        self.due_at: list[int] = [NEVER] * models
        self._heap: list[tuple[int, list[int]]] = []
        self._most_pairs = 2 * models + _SPARE
        self._open_at = NEVER
        self._open: list[int] = []
        """The models of the newest pair, which is for `_open_at`; others may still join them."""

    def book(self, model: int, at: int) -> None:
        """Make `at` the one instant at which `model` is due; from NEVER on it is never due."""
        if at >= NEVER:
            self.due_at[model] = NEVER
        elif self.due_at[model] != at:
            self.due_at[model] = at
            if at == self._open_at:
                self._open.append(model)
            else:
                self._open_at, self._open = at, [model]
                heappush(self._heap, (at, self._open))
                if len(self._heap) > self._most_pairs:
                    self._drop_stale()

    def next_at(self) -> int:
        """The earliest instant somebody is due at, or NEVER."""
        heap, due_at = self._heap, self.due_at
        while heap:
            at, models = heap[0]
            for model in models:
                if due_at[model] == at:
                    return at
            self._pop()
        return NEVER

    def take(self, at: int) -> list[int]:
        """Remove and return the models due at `at`, which is not past `next_at`, in order."""
        heap, due_at = self._heap, self.due_at
        due: list[int] = []
        while heap and heap[0][0] <= at:
            instant, models = self._pop()
            for model in models:
                if due_at[model] == instant:
                    due_at[model] = NEVER
                    due.append(model)
        due.sort()
        return due

    def _pop(self) -> tuple[int, list[int]]:
        pair = heappop(self._heap)
        if pair[1] is self._open:
            self._open_at = NEVER
        return pair

    def _drop_stale(self) -> None:
        bookings = [(at, [model]) for model, at in enumerate(self.due_at) if at != NEVER]
        self._heap[:] = sorted(bookings)
        self._open_at = NEVER
