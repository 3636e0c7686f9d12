"""Rows: which node stands above which in a column, at what height, so that wires run straight.

First the order: a node goes where the nodes that it is wired to are, on average, sweeping to and
fro. Then the heights: a node wants to be where its wires run level; nodes that want the same place
share the loss, and the order is kept.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from statistics import fmean, median_low
from typing import Final, TypeAlias, TypeVar

from firmware_runtime.view.diagram.boxes import End, Node, Wire

C = TypeVar("C")


def assign(components: Sequence[C], wires: Iterable[tuple[C, C]]) -> dict[C, int]:
    """Each component's column, from 1, given which feeds which."""
    wires = set(wires)
    order = {component: number for number, component in enumerate(components)}
    reached = {component: _reached(component, wires) for component in components}
    ahead: dict[C, set[C]] = {component: set() for component in components}
    for start, end in wires:
        if not (order[end] <= order[start] and start in reached[end]):
            ahead[end].add(start)
    columns: dict[C, int] = {}
    for component in components:
        _place(component, ahead, columns)
    return columns


def _reached(start: C, wires: Iterable[tuple[C, C]]) -> set[C]:
    """All that can be reached from a component, itself included."""
    reached = {start}
    waiting = [start]
    while waiting:
        at = waiting.pop()
        following = {end for source, end in wires if source == at} - reached
        reached |= following
        waiting += following
    return reached


def _place(component: C, ahead: Mapping[C, set[C]], columns: dict[C, int]) -> int:
    """One column right of the rightmost that feeds it."""
    if component not in columns:
        feeding = (_place(each, ahead, columns) for each in ahead[component])
        columns[component] = 1 + max(feeding, default=0)
    return columns[component]


Columns: TypeAlias = Sequence[list[Node]]
Neighbours: TypeAlias = dict[Node, list[tuple[End, End]]]
"""For each node the ends of its wires: its own, and the other one."""

SWEEPS: Final = 8


def arrange(columns: Columns, wires: Sequence[Wire]) -> float:
    """Order each column's list, set every node's `y`, the topmost at 0; return how deep it gets."""
    left: Neighbours = {node: [] for column in columns for node in column}
    right: Neighbours = {node: [] for column in columns for node in column}
    for wire in wires:
        left[wire.end.node].append((wire.end, wire.start))
        right[wire.start.node].append((wire.start, wire.end))
    both = {node: left[node] + right[node] for node in left}
    for column in columns:
        _stack(column)
    for column, neighbours in _sweeps(columns, left, right):
        column.sort(key=_Heights(neighbours).mean)
        _stack(column)
    for column, neighbours in _sweeps(columns, left, right):
        _settle(column, neighbours)
    for column in columns:
        _settle(column, both)
    _level(columns, left, right)
    top = min((node.y for node in both), default=0.0)
    for node in both:
        node.y = round(node.y - top)
    return max((node.y + node.height for node in both), default=0.0)


def _level(columns: Columns, left: Neighbours, right: Neighbours) -> None:
    """Last, leave the heavy nodes where they are and bring the light ones level with their ends."""
    for column in reversed(columns):
        ends = left if column is columns[-1] else right
        _settle(column, {node: ends[node] if node.weight == 1 else [] for node in column})


class _Heights:
    """Heights at which nodes are level with their neighbours."""

    def __init__(self, neighbours: Neighbours) -> None:
        self._neighbours = neighbours

    def mean(self, node: Node) -> float:
        """The mean height of the ends it is wired to, or its own."""
        pairs = self._neighbours[node]
        return fmean(other.y for _, other in pairs) if pairs else node.y + node.height / 2

    def wanted(self, node: Node) -> float:
        """The `y` at which the middle one of its wires is level, or its present one."""
        pairs = self._neighbours[node]
        return median_low(other.y - own.offset for own, other in pairs) if pairs else node.y


def _sweeps(
    columns: Columns, left: Neighbours, right: Neighbours
) -> Iterator[tuple[list[Node], Neighbours]]:
    """Columns from left to right, looking left, then back, looking right, and so on."""
    for sweep in range(SWEEPS):
        for column in reversed(columns) if sweep % 2 else columns:
            yield column, right if sweep % 2 else left


def _stack(column: Sequence[Node]) -> None:
    """One below the other from the top, in their order."""
    for node, y in zip(column, _tightest(column), strict=True):
        node.y = y


def _settle(column: Sequence[Node], neighbours: Neighbours) -> None:
    """Put each node as near to where it wants to be as order and clearance allow.

    Least squares under order: neighbours that get in each other's way are pooled.
    """
    heights = _Heights(neighbours)
    pools: list[tuple[float, float, int]] = []
    for node, tightest in zip(column, _tightest(column), strict=True):
        shift, weight, count = heights.wanted(node) - tightest, node.weight, 1
        while pools and pools[-1][0] > shift:
            other, other_weight, other_count = pools.pop()
            shift = (shift * weight + other * other_weight) / (weight + other_weight)
            weight, count = weight + other_weight, count + other_count
        pools.append((shift, weight, count))
    shifts = [shift for shift, _, count in pools for _ in range(count)]
    for node, tightest, shift in zip(column, _tightest(column), shifts, strict=True):
        node.y = tightest + shift


def _tightest(column: Sequence[Node]) -> Iterator[float]:
    """The `y` of each node if they stand as close as they may, the first at 0."""
    y = 0.0
    for number, node in enumerate(column):
        if number:
            y += column[number - 1].height + max(column[number - 1].clearance, node.clearance)
        yield y
