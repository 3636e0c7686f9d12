"""DEVStone: the four standard shapes LI, HI, HO and HOmod as models of this project.

A model of `depth` levels is a coupled model that holds the model of `depth - 1` levels and a set of
atomics whose number and wiring the shape decides; the innermost level holds one atomic. An atomic
answers each bag of input with one output in the same instant and spends no time of its own
(zero-time Dhrystone). The models have the atomics and couplings of `xdevs.examples.devstone` in
xdevs.py 3.0.0, so both engines do the same work.

Source: E. Glinsky, G. Wainer, "DEVStone: a benchmarking technique for studying performance of DEVS
modeling and simulation environments", DS-RT 2005; R. Cardenas, K. Henares, P. Arroba,
J. L. Risco-Martin, G. Wainer, "The DEVStone metric: performance analysis of DEVS simulation
engines", ACM TOMACS 32 (3), 2022.
"""

from itertools import pairwise
from typing import ClassVar

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER, ZERO


class DelayedAtomic(Atomic):
    """Answers a bag of input with one output, at once.

    It has no phases worth a name, so it sets the time advance and nothing else.
    With the verbs `passivate` and `activate`, which the peer's model uses, the benchmark took 18 %
    (HOmod) to 20 % (HI) longer on CPython 3.11.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.inlet = self.in_port("in", int)
        self.outlet = self.out_port("out", int)

    def output(self) -> None:
        """Send a value that is not looked at."""
        self.outlet.send(0)

    def internal(self) -> None:
        """Wait."""
        self.sigma = NEVER

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- waiting has no duration to use up
        """Answer."""
        self.sigma = ZERO


class Level(Coupled):
    """One level, and the levels inside it; the innermost holds one atomic."""

    inlet_count: ClassVar = 1
    outlet_count: ClassVar = 1
    inner: "Level"

    def __init__(self, width: int, depth: int) -> None:
        super().__init__(f"level_{depth}")
        self.width = width
        self.inlets = [self.in_port(f"in_{each}", int) for each in range(self.inlet_count)]
        self.outlets = [self.out_port(f"out_{each}", int) for each in range(self.outlet_count)]
        if depth == 1:
            atomic = self.add(DelayedAtomic("atomic"))
            self.couple(self.inlets[0], atomic.inlet)
            self.couple(atomic.outlet, self.outlets[0])
        else:
            self.inner = self.add(type(self)(width, depth - 1))
            self.couple(self.inlets[0], self.inner.inlets[0])
            self.couple(self.inner.outlets[0], self.outlets[0])
            self.fill()

    def fill(self) -> None:
        """Add this level's atomics and draw their couplings."""
        raise NotImplementedError

    def row(self, name: str, length: int) -> list[DelayedAtomic]:
        """Add a row of atomics."""
        return [self.add(DelayedAtomic(f"{name}_{place}")) for place in range(length)]

    def chain(self, atomics: list[DelayedAtomic]) -> None:
        """Let each atomic feed the next."""
        for source, destination in pairwise(atomics):
            self.couple(source.outlet, destination.inlet)


class LI(Level):
    """Low interconnection: the level's input feeds every atomic."""

    def fill(self) -> None:
        """Add width - 1 atomics."""
        for atomic in self.row("atomic", self.width - 1):
            self.couple(self.inlets[0], atomic.inlet)


class HI(Level):
    """High input: as LI, and each atomic feeds the next."""

    def fill(self) -> None:
        """Add width - 1 atomics."""
        atomics = self.row("atomic", self.width - 1)
        for atomic in atomics:
            self.couple(self.inlets[0], atomic.inlet)
        self.chain(atomics)


class HO(Level):
    """High output: as HI on a second input, and every atomic feeds a second output."""

    inlet_count = 2
    outlet_count = 2

    def fill(self) -> None:
        """Add width - 1 atomics."""
        self.couple(self.inlets[0], self.inner.inlets[1])
        atomics = self.row("atomic", self.width - 1)
        for atomic in atomics:
            self.couple(self.inlets[1], atomic.inlet)
            self.couple(atomic.outlet, self.outlets[1])
        self.chain(atomics)


class HOmod(Level):
    """High output, modified: a triangle of rows that feed each other and the level inside."""

    inlet_count = 2

    def fill(self) -> None:
        """Add a row of width - 1 atomics, and below it rows of width - 1, width - 2, ... 1."""
        first = self.row("row_1", self.width - 1)
        for atomic in first:
            self.couple(self.inlets[1], atomic.inlet)
            self.couple(atomic.outlet, self.inner.inlets[1])
        above = first
        for number in range(2, self.width + 1):
            row = self.row(f"row_{number}", self.width + 1 - number)
            self.couple(self.inlets[1], row[0].inlet)
            self.feed_back(row, above, to_all=number == 2)
            above = row

    def feed_back(
        self, row: list[DelayedAtomic], above: list[DelayedAtomic], *, to_all: bool
    ) -> None:
        """Let a row feed the one above: each atomic all of them, or the next but its own place."""
        for place, atomic in enumerate(row):
            for fed in above if to_all else above[place + 1 : place + 2]:
                self.couple(atomic.outlet, fed.inlet)


class Seeder(Atomic):
    """Sends the one value that sets a model going."""

    def __init__(self) -> None:
        super().__init__("seeder")
        self.outlet = self.out_port("out", int)

    def initialize(self) -> None:
        """Send at once."""
        self.activate()

    def output(self) -> None:
        """Send the seed."""
        self.outlet.send(0)


SHAPES: dict[str, type[Level]] = {"LI": LI, "HI": HI, "HO": HO, "HOmod": HOmod}


def devstone(shape: str, width: int, depth: int) -> Coupled:
    """A whole DEVStone model: a seeder that feeds every input of the model of the shape."""
    top = Coupled("devstone")
    seeder = top.add(Seeder())
    model = top.add(SHAPES[shape](width, depth))
    for inlet in model.inlets:
        top.couple(seeder.outlet, inlet)
    return top
