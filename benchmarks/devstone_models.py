"""DEVStone: the four standard shapes LI, HI, HO and HOmod as models of this project.

A model of `depth` levels is a coupled model that holds the model of `depth - 1` levels and a set of
atomics whose number and wiring the shape decides; the innermost level holds one atomic. An atomic
answers each bag of input with one output in the same instant. The models mirror, atomic for atomic
and coupling for coupling, `xdevs.examples.devstone` of xdevs.py 3.0.0, so both engines do the same
work.

Source: E. Glinsky, G. Wainer, "DEVStone: a benchmarking technique for studying performance of DEVS
modeling and simulation environments", DS-RT 2005; R. Cardenas, K. Henares, P. Arroba,
J. L. Risco-Martin, G. Wainer, "The DEVStone metric: performance analysis of DEVS simulation
engines", ACM TOMACS 32 (3), 2022.
"""

from collections.abc import Callable
from typing import Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort


class DelayedAtomic(Atomic):
    """Answers a bag of input with one output at once; each transition does `work`, if any."""

    def __init__(self, name: str, work: Callable[[], object] | None) -> None:
        super().__init__(name)
        self.work = work
        self.inlet = self.in_port("in", int)
        self.outlet = self.out_port("out", int)

    def output(self) -> None:
        self.outlet.send(0)

    def internal(self) -> None:
        if self.work is not None:
            self.work()
        self.passivate()

    def external(self, elapsed: int) -> None:  # noqa: ARG002
        if self.work is not None:
            self.work()
        self.activate()


class Level(Coupled):
    """One level of any shape, and the levels inside it; the innermost holds one atomic."""

    def __init__(
        self, name: str, width: int, depth: int, work: Callable[[], object] | None
    ) -> None:
        super().__init__(name)
        self.width = width
        self.depth = depth
        self.work = work
        self.inlet = self.in_port("in", int)
        self.outlet = self.out_port("out", int)
        if depth == 1:
            atomic = self.add_atomic("atomic_0")
            self.couple(self.inlet, atomic.inlet)
            self.couple(atomic.outlet, self.outlet)
        else:
            self.inner = self.add(type(self)(f"level_{depth - 1}", width, depth - 1, work))
            self.couple(self.inlet, self.inner.inlet)
            self.couple(self.inner.outlet, self.outlet)
            self.fill()

    def add_atomic(self, name: str) -> DelayedAtomic:
        return self.add(DelayedAtomic(name, self.work))

    def fill(self) -> None:
        """Add the atomics of this level and draw their couplings."""
        raise NotImplementedError

    def inlets(self) -> tuple[InPort[int], ...]:
        """Where the seed goes."""
        return (self.inlet,)


class LI(Level):
    """Low interconnection: every atomic hangs on the level's input."""

    def fill(self) -> None:
        for index in range(self.width - 1):
            atomic = self.add_atomic(f"atomic_{index}")
            self.couple(self.inlet, atomic.inlet)


class HI(Level):
    """High input: as LI, and each atomic feeds the next."""

    def fill(self) -> None:
        previous: DelayedAtomic | None = None
        for index in range(self.width - 1):
            atomic = self.add_atomic(f"atomic_{index}")
            self.couple(self.inlet, atomic.inlet)
            if previous is not None:
                self.couple(previous.outlet, atomic.inlet)
            previous = atomic


class HO(Level):
    """High output: as HI on a second input, and each atomic feeds a second output as well."""

    def __init__(
        self, name: str, width: int, depth: int, work: Callable[[], object] | None
    ) -> None:
        self.inlet_2: InPort[int]
        super().__init__(name, width, depth, work)
