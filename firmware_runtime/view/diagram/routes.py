"""Routes: between two columns lies a channel, in which wires change their height.

In a channel all wires of a net share a trunk, a vertical on a track of its own; tracks are ordered
so that few wires cross. Feedback goes down on a trunk in the channel right of its source, back in
a lane below everything, and up in the channel left of its end.
"""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations, product
from math import inf
from typing import Final

from firmware_runtime.view.diagram.boxes import Wire
from firmware_runtime.view.diagram.canvas import Point

TRACK: Final = 11
"""From one track or lane to the next."""
CHANNEL: Final = 26
"""The least width of a channel."""
LEVEL: Final = 0.5
"""Heights no further apart than this are the same."""


@dataclass(eq=False, slots=True)
class Trunk:
    """A net's vertical in one channel."""

    entries: set[float] = field(default_factory=set)
    """Heights at which wires come in from the left."""
    exits: set[float] = field(default_factory=set)
    """Heights at which wires go out to the right."""
    is_deep: bool = False
    """True if it reaches down to a lane."""
    x: float = 0.0

    @property
    def top(self) -> float:
        """The height of its upper end."""
        return min(self.entries | self.exits)

    @property
    def bottom(self) -> float:
        """The height of its lower end."""
        return inf if self.is_deep else max(self.entries | self.exits)

    @property
    def is_point(self) -> bool:
        """Return whether the wire passes the channel on one level and needs no track."""
        return self.bottom - self.top < LEVEL

    def crossed(self, heights: set[float]) -> int:
        """Count the horizontals at these heights that cross it."""
        return sum(self.top < height < self.bottom for height in heights)


class Channel:
    """The space between two columns."""

    def __init__(self) -> None:
        self.x = 0.0
        self._trunks: dict[Hashable, Trunk] = {}

    def trunk(self, key: Hashable) -> Trunk:
        """The trunk of that key, a new one if need be."""
        return self._trunks.setdefault(key, Trunk())

    def place(self, x: float) -> float:
        """Put the channel right of `x` and give each trunk its track; return the channel's end."""
        tracks = _ordered([trunk for trunk in self._trunks.values() if not trunk.is_point])
        width = max(CHANNEL, TRACK * (len(tracks) + 1))
        first = x + (width - TRACK * (len(tracks) - 1)) / 2
        for number, trunk in enumerate(tracks):
            trunk.x = first + number * TRACK
        return x + width


class Routes:
    """The routes of one coupled model's wires; made from nodes whose heights are settled."""

    def __init__(self, columns: int) -> None:
        self.channels = [Channel() for _ in range(columns - 1)]
        self._feedback: dict[Hashable, list[Wire]] = {}

    def note(self, wire: Wire) -> None:
        """Take a wire in: its trunk or trunks, and its lane if it is feedback."""
        start, end = wire.start, wire.end
        if not wire.is_feedback:
            trunk = self.channels[start.node.column].trunk(wire.net)
            trunk.entries.add(start.y)
            trunk.exits.add(end.y)
            return
        down, up = self._down(wire), self._up(wire)
        down.entries.add(start.y)
        up.exits.add(end.y)
        down.is_deep = up.is_deep = True
        self._feedback.setdefault(wire.net, []).append(wire)

    def points(self, wire: Wire, bottom: float) -> list[Point]:
        """The wire's way; `bottom` is where the lanes begin."""
        start = Point(wire.start.node.x + wire.start.node.width, wire.start.y)
        end = Point(wire.end.node.x, wire.end.y)
        if wire.is_feedback:
            lane = bottom + TRACK * self._lane(wire.net)
            down, up = self._down(wire).x, self._up(wire).x
            back = (Point(down, start.y), Point(down, lane), Point(up, lane), Point(up, end.y))
            return [start, *back, end]
        trunk = self.channels[wire.start.node.column].trunk(wire.net)
        if trunk.is_point:
            return [start, Point(end.x, start.y)]
        return [start, Point(trunk.x, start.y), Point(trunk.x, end.y), end]

    @property
    def depth(self) -> float:
        """Height of all lanes together."""
        return TRACK * (len(self._feedback) + 1) if self._feedback else 0.0

    def _lane(self, net: Hashable) -> int:
        """The lane's number from the top; what goes back the shortest way is uppermost."""
        return 1 + sorted(self._feedback, key=self._length).index(net)

    def _length(self, net: Hashable) -> float:
        """Return how far back a net's feedback goes."""
        return max(self._down(wire).x - self._up(wire).x for wire in self._feedback[net])

    def _down(self, wire: Wire) -> Trunk:
        return self.channels[wire.start.node.column].trunk((wire.net, "down"))

    def _up(self, wire: Wire) -> Trunk:
        return self.channels[wire.end.node.column - 1].trunk((wire.net, "up"))


def _ordered(tracks: list[Trunk]) -> list[Trunk]:
    """From left to right; a track moves elsewhere as long as that saves a crossing."""
    best = tracks
    for _ in tracks:
        moved = min(_rearranged(best), key=_crossings)
        if _crossings(moved) >= _crossings(best):
            break
        best = moved
    return best


def _rearranged(tracks: Sequence[Trunk]) -> Iterator[list[Trunk]]:
    """Every order that differs in the place of one track, and the present one."""
    for start, end in product(range(len(tracks)), repeat=2):
        moved = list(tracks)
        moved.insert(end, moved.pop(start))
        yield moved


def _crossings(tracks: Sequence[Trunk]) -> int:
    """Count the crossings of the wires of these trunks in this order."""
    return sum(
        left.crossed(right.entries) + right.crossed(left.exits)
        for left, right in combinations(tracks, 2)
    )
