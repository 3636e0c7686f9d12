"""The agenda: which models are due at which instant.

A heap holds each instant once; a dictionary maps it to the models booked for it. Rebooking leaves
the old entry behind; it is dropped when its instant comes, because `due_at` no longer agrees
(lazy deletion). Many models with one period cost one heap operation, not one each.
"""

from heapq import heappop, heappush

from firmware_runtime.devs.time import NEVER


class Agenda:
    """Bookings of models, by number, at instants in the future; `due_at[i]` is the valid one."""

    __slots__ = ("_booked", "_instants", "due_at")

    def __init__(self, models: int) -> None:
        self.due_at: list[int] = [NEVER] * models
        self._booked: dict[int, list[int]] = {}
        self._instants: list[int] = []

    def book(self, model: int, at: int) -> None:
        """Make `at` the one instant at which `model` is due."""
        if self.due_at[model] == at:
            return
        self.due_at[model] = at
        if at == NEVER:
            return
        booked = self._booked.get(at)
        if booked is None:
            self._booked[at] = [model]
            heappush(self._instants, at)
        else:
            booked.append(model)

    def next_at(self) -> int:
        """The earliest instant somebody is due at, or NEVER."""
        instants = self._instants
        while instants:
            at = instants[0]
            if any(self.due_at[model] == at for model in self._booked[at]):
                return at
            del self._booked[heappop(instants)]
        return NEVER

    def take(self, at: int) -> list[int]:
        """Remove and return the models due at `at`, in order of declaration."""
        if not self._instants or self._instants[0] != at:
            return []
        booked = self._booked.pop(heappop(self._instants))
        due_at = self.due_at
        if len(booked) == 1:
            due = booked if due_at[booked[0]] == at else []
        else:
            due = sorted({model for model in booked if due_at[model] == at})
        for model in due:
            due_at[model] = NEVER
        return due
