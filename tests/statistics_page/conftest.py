"""Statistics of runs of many kinds, and the page made of each."""

from collections.abc import Callable
from functools import cache

import pytest
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.fault_table import FaultCount
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.statistics import Statistics
from tests.support.written_run import LAYOUT, WrittenRun, uneven_run


def _on_time() -> Statistics:
    run = WrittenRun(clock="VirtualClock")
    for number in range(30):
        run.activation(number * 100 * MILLISECOND, 0, 0)
    return run.statistics(RunState.ENDED)


def _without_periods() -> Statistics:
    run = WrittenRun(replace(LAYOUT, models=(), deadlines=(), buses=()))
    run.elapsed = 5 * SECOND
    return run.statistics(RunState.ENDED)


def _hostile() -> Statistics:
    name = "</title><script>alert(1)</script>\0\ud800 &amp; \"'"
    layout = replace(
        LAYOUT,
        models=(name, "compass"),
        timed=(name,),
        buses=("</svg>",),
        fault_models=("<script>",),
    )
    run = WrittenRun(layout, board=name, kernel=name)
    run.activation(0, 3 * MILLISECOND, MILLISECOND)
    run.keep([1000], lateness_ns=3 * MILLISECOND, step_ns=1000)
    faults = [FaultCount(name, 7, 0, SECOND, name)]
    fault_table.fill(run.cells[layout.faults], 0, faults)
    return run.statistics()


RUNS: dict[str, Callable[[], Statistics]] = {
    "uneven": lambda: uneven_run().statistics(RunState.ENDED),
    "under way": lambda: uneven_run(20).statistics(),
    "died": lambda: uneven_run(20).statistics(alive=False, complete=False),
    "failed": lambda: uneven_run(20).statistics(RunState.FAILED),
    "on time": _on_time,
    "without periods": _without_periods,
    "not begun": lambda: WrittenRun().statistics(),
    "hostile": _hostile,
}


@cache
def _run(kind: str) -> Statistics:
    return RUNS[kind]()


@pytest.fixture(params=RUNS)
def any_run(request: pytest.FixtureRequest) -> Statistics:
    """One of each kind."""
    return _run(request.param)


@pytest.fixture
def uneven() -> Statistics:
    """A run of 200 s with one stall of half a second after 5.7 s."""
    return _run("uneven")


@pytest.fixture
def hostile() -> Statistics:
    """A run whose names are written by an enemy."""
    return _run("hostile")
