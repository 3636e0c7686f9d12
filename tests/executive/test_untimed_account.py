"""In virtual time, where no clock is read in a step, the same is counted as on any clock."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.statistics.layout import MODEL, STEP_HISTOGRAM, STEPS
from tests.support.executives import Run
from tests.support.stalling_clock import StallingClock

SPANS = (0, MILLISECOND, 2 * MILLISECOND, 5 * MILLISECOND, NEVER)
NO_SPAN = -1
"""A time advance that is refused."""
FAILURE = -2
"""In the place of a span: the model raises an error."""
plans = st.lists(st.sampled_from(SPANS), min_size=1, max_size=30)
ends = st.sampled_from([NEVER, NO_SPAN, FAILURE])
periods = st.sampled_from([NEVER, MILLISECOND, 5 * MILLISECOND])


class Planned(Atomic):
    """Holds for one span of a plan after the other, whatever happens; passive at its end."""

    def __init__(self, name: str, plan: list[int], period: int) -> None:
        super().__init__(name)
        self.period = period
        self.into = self.in_port("into", int)
        self.out = self.out_port("out", int)
        self._plan = iter(plan)

    def initialize(self) -> None:
        self.internal()

    def output(self) -> None:
        self.out.send(1)

    def internal(self) -> None:
        span = next(self._plan, NEVER)
        if span == FAILURE:
            raise ZeroDivisionError
        self.hold_in("waiting", span)

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- any input moves it on
        self.internal()


def counted(
    clock: Clock, one: list[int], other: list[int], period: int = NEVER
) -> tuple[list[list[int]], bool]:
    """Every cell of two models that move each other on, and whether no clock was read in a step.

    The first one has the period.
    """
    root = Coupled("root")
    first = root.add(Planned("first", [MILLISECOND, *one], period))
    second = root.add(Planned("second", [MILLISECOND, *other], NEVER))
    root.couple(first.out, second.into)
    root.couple(second.out, first.into)
    run = Run(root, clock)
    run.until(100 * MILLISECOND)
    file = run.executive._ledger.file
    blocks = [file.layout.lateness, file.layout.step]
    cells = [list(file.cells[block(index)]) for block in blocks for index in (0, 1)]
    begins = [file.layout.model(index) for index in (0, 1)]
    cells += [list(file.cells[begin : begin + len(MODEL)]) for begin in begins]
    cells.append([*file.cells[STEPS : STEPS + 1], *file.cells[STEP_HISTOGRAM]])
    return cells, run.executive._profiler.step.stands_still


@pytest.mark.slow
@given(plans, plans, ends, periods)
def test_it_counts_the_same_as_where_functions_may_take_time(
    one: list[int], other: list[int], end: int, period: int
) -> None:
    untimed, is_untimed = counted(VirtualClock(), one, [*other, end], period)
    timed, is_timed = counted(StallingClock(), one, [*other, end], period)
    assert (is_untimed, is_timed) == (True, False)
    assert untimed == timed
