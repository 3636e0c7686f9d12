"""The agenda: which models are due at which instant.

A heap holds each instant once; a dictionary maps it to the models booked for it. Rebooking leaves
the old entry behind; it is passed over when its instant comes, because `due_at` no longer agrees
(lazy deletion). Many models with one period cost one heap operation, not one each. When the entries
left behind outnumber the models, all are dropped at once, so a timeout that is always rebooked and
never comes does not fill the memory.
"""

from heapq import heappop, heappush

from firmware_runtime.devs.time import NEVER

_SPARE = 64
"""Instants beyond two a model that the heap may hold before it is rid of stale ones."""


class Agenda:
    """Bookings of models, by number, at instants in the future; `due_at[i]` is the valid one."""

    def __init__(self, models: int) -> None:
        self.due_at: list[int] = [NEVER] * models
        self._booked: dict[int, list[int]] = {}
        self._instants: list[int] = []
        self._most_instants = 2 * models + _SPARE

    def book(self, model: int, at: int) -> None:
        """Make `at` the one instant at which `model` is due; from NEVER on it is never due."""
        if at >= NEVER:
            self.due_at[model] = NEVER
        elif self.due_at[model] != at:
            self.due_at[model] = at
            if at in self._booked:
                self._booked[at].append(model)
            else:
                self._booked[at] = [model]
                heappush(self._instants, at)
                if len(self._instants) > self._most_instants:
                    self._drop_stale()

    def next_at(self) -> int:
        """The earliest instant somebody is due at, or NEVER."""
        instants, due_at = self._instants, self.due_at
        while instants:
            at = instants[0]
            for model in self._booked.get(at, ()):
                if due_at[model] == at:
                    return at
            heappop(instants)
            self._booked.pop(at, None)
        return NEVER

    def take(self, at: int) -> list[int]:
        """Remove and return the models due at `at`, in order of declaration."""
        due_at = self.due_at
        due: list[int] = []
        for model in self._booked.pop(at, ()):
            if due_at[model] == at:
                due_at[model] = NEVER
                due.append(model)
        due.sort()
        return due

    def _drop_stale(self) -> None:
        self._booked.clear()
        for model, at in enumerate(self.due_at):
            if at != NEVER:
                self._booked.setdefault(at, []).append(model)
        self._instants[:] = sorted(self._booked)
