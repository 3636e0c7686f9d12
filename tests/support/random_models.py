"""Random hierarchical models, and their flat equals made by hand, for tests of the kernel's laws.

A `Blueprint` says what to build: a tree of cells and groups, each with the ports `in_0`, `in_1`,
`out_0`, `out_1`, and wires. `build` builds it as it is drawn; `build_flat` puts all cells into one
coupled model and draws a wire for each route, found here by walking the blueprint.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from hypothesis import strategies as st

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.devs.time import NEVER

SIDES = (0, 1)
End: TypeAlias = tuple[str, str]
"""A component's name (unique in the whole tree) and a port's name."""


class Cell(Atomic):
    """A deterministic automaton whose every reaction depends on all it has seen, in order.

    Its time advances come from `times`, chosen by its state; zero is among them, but each one
    taken costs energy, of which it has `ENERGY`, so that every loop ends.
    """

    ENERGY = 12

    def __init__(self, name: str, seed: int, times: tuple[int, ...]) -> None:
        super().__init__(name)
        self.inlets = [self.in_port(f"in_{side}", int) for side in SIDES]
        self.outlets = [self.out_port(f"out_{side}", int) for side in SIDES]
        self.seed = seed
        self.times = times
        self.state = seed
        self.energy = self.ENERGY

    def initialize(self) -> None:
        self.state, self.energy = self.seed, self.ENERGY
        self._plan()

    def output(self) -> None:
        if self.state % 3 != 0:
            self.outlets[self.state % 2].send(self.state)
        if self.state % 5 == 0:
            self.outlets[1].send(-self.state)

    def internal(self) -> None:
        self._learn(7)
        self._plan()

    def external(self, elapsed: int) -> None:
        self._learn(elapsed)
        for inlet in self.inlets:
            for value in inlet:
                self._learn(value)
        if self.state % 4 == 0:
            self.continue_(elapsed)
        else:
            self._plan()

    def _learn(self, value: int) -> None:
        self.state = (self.state * 31 + value) % 10_007

    def _plan(self) -> None:
        self.energy -= 1
        times = self.times if self.energy > 0 else (NEVER,)
        self.hold_in("planned", times[self.state % len(times)])


@dataclass
class Node:
    """A cell, or a group of nodes with the wires between them."""

    name: str
    seed: int
    times: tuple[int, ...]
    children: list["Node"] = field(default_factory=list)
    wires: list[tuple[End, End]] = field(default_factory=list)

    def cells(self) -> Iterator["Node"]:
        """The cells below, in order of declaration."""
        if not self.children:
            yield self
        for child in self.children:
            yield from child.cells()

    def groups(self) -> Iterator["Node"]:
        """This group and those below, if it is one."""
        if self.children:
            yield self
            for child in self.children:
                yield from child.groups()


def build(node: Node) -> Component:
    """The model as drawn."""
    if not node.children:
        return Cell(node.name, node.seed, node.times)
    group = Coupled(node.name)
    for side in SIDES:
        group.in_port(f"in_{side}", int)
        group.out_port(f"out_{side}", int)
    parts = {child.name: group.add(build(child)) for child in node.children}
    parts[node.name] = group
    for source, destination in node.wires:
        group.couple(_port(parts, source), _port(parts, destination))
    return group


def build_flat(root: Node) -> Coupled:
    """All cells in one coupled model, every route one wire."""
    flat = Coupled(root.name)
    parts: dict[str, Component] = {cell.name: flat.add(build(cell)) for cell in root.cells()}
    parts[root.name] = flat
    for side in SIDES:
        flat.in_port(f"in_{side}", int)
    for source, destination in routes(root):
        flat.couple(_port(parts, source), _port(parts, destination))
    return flat


class LoopOfWires(Exception):
    """Wires lead round through no cell."""


def routes(root: Node) -> list[tuple[End, End]]:
    """From each cell's output and each input of the root to each cell's input it leads to."""
    wires = [wire for group in root.groups() for wire in group.wires]
    cells = [cell.name for cell in root.cells()]

    def follow(*way: End) -> Iterator[End]:
        if way[-1] in way[:-1]:
            raise LoopOfWires
        for source, destination in wires:
            if source == way[-1]:
                if destination[0] in cells:
                    yield destination
                else:
                    yield from follow(*way, destination)

    for source, _ in wires:
        list(follow(source))
    starts = [(name, f"out_{side}") for name in cells for side in SIDES]
    starts += [(root.name, f"in_{side}") for side in SIDES]
    return [(start, end) for start in starts for end in follow(start)]


def _port(parts: dict[str, Component], end: End) -> AnyPort:
    name, port = end
    ports: dict[str, AnyPort] = {**parts[name].in_ports, **parts[name].out_ports}
    return ports[port]


@st.composite
def blueprints(draw: st.DrawFn) -> Node:
    """A tree of one to nine cells, up to four levels deep, with random wires."""
    names = (f"n{number}" for number in range(1000))
    root = draw(_groups(names, depth=3))
    for group in root.groups():
        _draw_wires(draw, root, group)
    return root


@st.composite
def _groups(draw: st.DrawFn, names: Iterator[str], depth: int) -> Node:
    node = Node(next(names), 0, ())
    for _ in range(draw(st.integers(1, 3))):
        if depth > 0 and draw(st.booleans()):
            node.children.append(draw(_groups(names, depth - 1)))
        else:
            node.children.append(draw(_cells(names)))
    return node


@st.composite
def _cells(draw: st.DrawFn, names: Iterator[str]) -> Node:
    times = st.lists(st.sampled_from([0, 1, 2, 3, 5, NEVER]), min_size=1, max_size=4)
    return Node(next(names), draw(st.integers(0, 99)), tuple(draw(times)))


def _draw_wires(draw: st.DrawFn, root: Node, group: Node) -> None:
    """Draw wires into a group, except those that would double a route or feed a cell itself.

    What a flat model cannot draw: between two ports it has at most one wire, and none from a model
    to itself.
    """
    sources = [(child.name, f"out_{side}") for child in group.children for side in SIDES]
    sources += [(group.name, f"in_{side}") for side in SIDES]
    ends = [(child.name, f"in_{side}") for child in group.children for side in SIDES]
    ends += [(group.name, f"out_{side}") for side in SIDES]
    wires = st.lists(st.tuples(st.sampled_from(sources), st.sampled_from(ends)), max_size=12)
    for wire in draw(wires):
        if (wire[0][0] == wire[1][0] != group.name) or wire in group.wires:
            continue
        group.wires.append(wire)
        try:
            found = routes(root)
        except LoopOfWires:
            group.wires.pop()
            continue
        if len(set(found)) < len(found) or any(start[0] == end[0] for start, end in found):
            group.wires.pop()
