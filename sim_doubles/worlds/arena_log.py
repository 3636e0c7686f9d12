"""The log of a run in the arena: every ping, and what state each model was in; for the picture.

The path needs no log: the arena remembers it.
"""

import math
from collections.abc import Collection
from typing import NamedTuple

from sim_doubles.worlds.arena import Arena
from sim_doubles.worlds.arena_geometry import Beam

__all__ = ["ArenaLog", "Ping", "Stay"]


class Ping(NamedTuple):
    """One ping of a sonar; no echo is infinity."""

    at: int
    beam: Beam
    echo_m: float


class Stay(NamedTuple):
    """Stay of a model in a state, in ns."""

    state: str
    since: int
    until: int


class ArenaLog:
    """Stands between the sonars' doubles and the arena; gives the arena's echoes and notes them."""

    def __init__(self, arena: Arena) -> None:
        self.arena = arena
        self.radar_pings: list[Ping] = []
        self.body_pings: list[Ping] = []
        self._entries: dict[str, list[tuple[int, str]]] = {}

    def radar_echoes(self, at: int) -> list[float]:
        """The arena's echoes to the sonar on the radar's head."""
        echoes = self.arena.radar_echoes(at)
        self.radar_pings.append(Ping(at, self.arena.radar_beam(at), min(echoes, default=math.inf)))
        return echoes

    def body_echoes(self, at: int) -> list[float]:
        """The arena's echoes to the sonar on the body."""
        echoes = self.arena.body_echoes(at)
        self.body_pings.append(Ping(at, self.arena.body_beam(at), min(echoes, default=math.inf)))
        return echoes

    def enter(self, at: int, model: str, state: str) -> None:
        """Note that a model is in a state from `at` on; models are shown in order of entry."""
        self._entries.setdefault(model, []).append((at, state))

    def since(self, model: str, states: Collection[str]) -> int | None:
        """Return since when a model has been in one of some states, ns; None where it is not."""
        found = None
        for at, state in reversed(self._entries.get(model, [])):
            if state not in states:
                break
            found = at
        return found

    def stays(self, until: int) -> dict[str, list[Stay]]:
        """The states of each model one after the other, the last up to `until`."""
        return {model: _stays(entries, until) for model, entries in self._entries.items()}


def _stays(entries: list[tuple[int, str]], until: int) -> list[Stay]:
    ends = [at for at, _ in entries[1:]] + [until]
    return [
        Stay(state, since, end)
        for (since, state), end in zip(entries, ends, strict=True)
        if end > since
    ]
