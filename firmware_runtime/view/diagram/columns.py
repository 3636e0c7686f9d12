"""Columns: signals flow from left to right, except for feedback.

A wire is feedback if it leads to a component that it comes from in turn, and that one is not
declared later. Left to right, a component stands behind all that feed it.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

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
