"""The time advance, computed or set, how things stand before a run, and time itself."""

import enum
import gc
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.model_errors import IllegitimateModel
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import (
    MICROSECOND,
    MILLISECOND,
    NANOSECOND,
    NEVER,
    SECOND,
    format_time,
    kept,
    seconds,
)
from tests.support.devs_models import Clock, Echo, Log, Scripted, top, traced


class Table(Atomic):
    """Computes its time advance from its state: 3, 1, 4, 1, 5 ns, then never."""

    TIMES = (3, 1, 4, 1, 5, NEVER)

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.step = 0
        self.inlet = self.in_port("in", int)
        self.outlet = self.out_port("out", int)

    def time_advance(self) -> int:
        return self.TIMES[self.step]

    def output(self) -> None:
        self.outlet.send(self.step)

    def internal(self) -> None:
        self.step += 1

    def external(self, elapsed: int) -> None:
        self.step = elapsed


def test_a_model_may_compute_its_time_advance() -> None:
    messages = traced(Simulator(Table("table")), 100)
    assert [(at, value) for at, _, value in messages] == [(3, 0), (4, 1), (8, 2), (9, 3), (14, 4)]


def test_a_computed_time_advance_is_called_after_every_kind_of_transition() -> None:
    table = Table("table")
    simulator = Simulator(table)
    simulator.inject(table.inlet, 0)
    simulator.advance(2)
    assert (table.step, simulator.next_at) == (2, 6)
    simulator.inject(table.inlet, 0)
    simulator.advance(6)
    assert (table.step, simulator.next_at) == (0, 9)


class TableWithConfluent(Table):
    """Starts again where two events meet."""

    def confluent(self) -> None:
        self.step = 4


def test_a_computed_time_advance_is_called_after_an_own_confluent_function() -> None:
    table = TableWithConfluent("table")
    simulator = Simulator(table)
    simulator.inject(table.inlet, 0)
    simulator.advance(3)
    assert (table.step, simulator.next_at) == (4, 8)


def test_initial_conditions_hold_and_the_first_instant_is_not_lost() -> None:
    clock, idle = Clock("clock", 5, offset=0), Log("idle")
    simulator = Simulator(top(clock, idle))
    assert (simulator.now, simulator.next_at) == (0, 0)
    assert (simulator.due_at(clock), simulator.due_at(idle)) == (0, NEVER)
    assert (clock.phase, idle.phase) == ("ticking", "passive")
    assert (simulator.internal_transitions, simulator.external_transitions) == (0, 0)
    assert traced(Simulator(top(Clock("clock", 5, offset=0))), 5) == [
        (0, "clock.ticks", 0),
        (5, "clock.ticks", 1),
    ]


@pytest.fixture
def collecting() -> Iterator[None]:
    """Garbage is collected again afterwards."""
    yield
    gc.enable()


@pytest.mark.usefixtures("collecting")
@pytest.mark.parametrize("switch", [gc.enable, gc.disable])
def test_no_garbage_is_collected_while_a_model_is_made_ready_and_then_it_is_as_before(
    switch: Callable[[], None],
) -> None:
    collected: list[bool] = []

    class Looking(Log):
        def initialize(self) -> None:
            collected.append(gc.isenabled())

    switch()
    before = gc.isenabled()
    Simulator(top(Looking("looking")))
    assert (collected, gc.isenabled()) == ([False], before)


def test_a_model_of_passive_models_ends_at_once() -> None:
    simulator = Simulator(top(Log("log")))
    simulator.run(NEVER)
    assert (simulator.now, simulator.next_at) == (0, NEVER)


def test_an_atomic_model_alone_is_state_in_and_state_out() -> None:
    echo = Echo("echo", delay=5)
    echo.inlet.extend([1, 2])
    echo.external(0)
    assert (echo.held, echo.phase, echo.sigma) == ([1, 2], "holding", 5)
    echo.external(3)
    assert (echo.phase, echo.sigma) == ("holding", 2)
    echo.output()
    echo.internal()
    assert (echo.held, echo.phase, echo.sigma) == ([], "passive", NEVER)
    model = Atomic("model")
    model.hold_in("waiting", 5)
    model.external(3)  # its own functions leave the phase alone up to its end
    assert (model.phase, model.sigma) == ("waiting", 2)
    model.internal()
    assert (model.phase, model.sigma) == ("passive", NEVER)


class Whole(enum.IntEnum):
    """Whole numbers that are no plain `int`."""

    FOUR = 4


BOTH = pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])


@BOTH
@pytest.mark.parametrize("sigma", [np.int64(4), np.uint8(4), Whole.FOUR])
@pytest.mark.parametrize("company", [0, 2])
def test_a_whole_number_of_any_type_is_a_time_advance(
    kind: type[Engine], sigma: int, company: int
) -> None:
    """After initialization, an internal transition and an external one; alone and in company."""
    model, log = Scripted("model", sigma=sigma), Log("log")
    model.on_output = lambda: model.outlet.send(1)
    model.on_internal = lambda: model.hold_in("again", sigma)
    model.on_external = lambda _elapsed: model.hold_in("again", sigma)
    root = top(model, log, *(Clock(f"clock_{number}", 4) for number in range(company)))
    inlet = root.in_port("in", int)
    root.couple(model.outlet, log.values)
    root.couple(inlet, model.inlet)
    simulator = kind(root)
    simulator.run(8)
    simulator.inject(inlet, 1)
    simulator.advance(9)
    simulator.run(13)
    assert log.elapsed == [4, 4, 5]
    assert type(model.sigma) is int


@BOTH
@pytest.mark.parametrize("company", [0, 2])
def test_a_nanosecond_of_another_type_takes_time(kind: type[Engine], company: int) -> None:
    model = Scripted("model", sigma=4)
    model.on_internal = lambda: model.hold_in("again", np.int64(1))  # type: ignore[arg-type]
    model.on_external = lambda _elapsed: model.hold_in("again", np.int64(1))  # type: ignore[arg-type]
    simulator = kind(top(model, *(Clock(f"clock_{number}", 4) for number in range(company))))
    simulator.run(4)
    assert simulator.due_at(model) == 5


@BOTH
@pytest.mark.parametrize("company", [0, 2])
def test_a_zero_of_another_type_takes_no_time_and_its_loops_end(
    kind: type[Engine], company: int
) -> None:
    looping = Scripted("looping", sigma=4)
    looping.on_internal = lambda: looping.hold_in("again", np.int64(0))  # type: ignore[arg-type]
    clocks = (Clock(f"clock_{number}", 4) for number in range(company))
    with pytest.raises(IllegitimateModel, match=r"^top\.looping at 0\.000000004 s"):
        kind(top(looping, *clocks), zero_time_limit=10).run(5)


def test_ten_and_twenty_milliseconds_are_thirty() -> None:
    assert seconds(0.010) + seconds(0.020) == seconds(0.030) == 30 * MILLISECOND


@pytest.mark.parametrize(
    ("value", "nanoseconds"),
    [
        (0, 0),
        (1e-9, NANOSECOND),
        (0.4e-9, 0),
        (1e-6, MICROSECOND),
        (2, 2 * SECOND),
        (-0.5, -SECOND // 2),
    ],
)
def test_seconds_become_the_nearest_nanosecond(value: float, nanoseconds: int) -> None:
    assert seconds(value) == nanoseconds
    assert type(seconds(value)) is int


@pytest.mark.parametrize(
    ("at", "text"),
    [
        (0, "0.000000000 s"),
        (1, "0.000000001 s"),
        (SECOND + 5 * MILLISECOND, "1.005000000 s"),
        (NEVER, "never"),
    ],
)
def test_an_instant_reads_as_seconds(at: int, text: str) -> None:
    assert format_time(at) == text


@given(st.integers(0, NEVER - 1))
def test_a_formatted_instant_loses_nothing(at: int) -> None:
    whole, _, rest = format_time(at).removesuffix(" s").partition(".")
    assert int(whole) * SECOND + int(rest) == at


def test_a_number_that_was_kept_leaves_room_for_more() -> None:
    most = 1 << 62
    for number in (0, most, -most, NEVER):
        assert kept(number) == number
    for other in (most + 1, -most - 1, 1.0, "1", None):
        with pytest.raises(ValueError, match="expected a whole number of less than 63 bits"):
            kept(other)


def test_never_is_later_than_any_instant_of_two_centuries() -> None:
    assert NEVER > 200 * 365 * 24 * 3600 * SECOND
