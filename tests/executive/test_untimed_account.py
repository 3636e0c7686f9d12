"""In virtual time an account counts what it counts on any clock."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.executive.untimed_account import UntimedEventAccount
from firmware_runtime.statistics.layout import MODEL
from tests.support.executives import Run
from tests.support.stalling_clock import StallingClock

SPANS = (0, MILLISECOND, 2 * MILLISECOND, 5 * MILLISECOND, NEVER)
plans = st.lists(st.sampled_from(SPANS), min_size=1, max_size=30)


class Planned(Atomic):
    """Holds for one span of a plan after the other, whatever happens; passive at its end."""

    def __init__(self, name: str, plan: list[int]) -> None:
        super().__init__(name)
        self.into = self.in_port("into", int)
        self.out = self.out_port("out", int)
        self._plan = iter(plan)

    def initialize(self) -> None:
        self.internal()

    def output(self) -> None:
        self.out.send(1)

    def internal(self) -> None:
        self.hold_in("waiting", next(self._plan, NEVER))

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- any input moves it on
        self.internal()


def counted(clock: Clock, one: list[int], other: list[int]) -> tuple[list[list[int]], bool]:
    """Every cell of two models that move each other on, and whether functions took no time."""
    root = Coupled("root")
    first, second = root.add(Planned("first", one)), root.add(Planned("second", other))
    root.couple(first.out, second.into)
    root.couple(second.out, first.into)
    run = Run(root, clock)
    run.until(100 * MILLISECOND)
    file = run.executive._ledger.file
    blocks = [file.layout.lateness, file.layout.step]
    cells = [list(file.cells[block(index)]) for block in blocks for index in (0, 1)]
    begins = [file.layout.model(index) for index in (0, 1)]
    cells += [list(file.cells[begin : begin + len(MODEL)]) for begin in begins]
    return cells, isinstance(run.executive.accounts[0], UntimedEventAccount)


@pytest.mark.slow
@given(plans, plans)
def test_it_counts_the_same_as_where_functions_may_take_time(
    one: list[int], other: list[int]
) -> None:
    untimed, is_untimed = counted(VirtualClock(), one, other)
    timed, is_timed = counted(StallingClock(), one, other)
    assert (is_untimed, is_timed) == (True, False)
    assert untimed == timed
