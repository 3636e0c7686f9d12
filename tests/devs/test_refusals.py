"""Bugs in models end the run with the model's path, the time and the reason."""

import math
from collections.abc import Callable

import pytest

from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.model_errors import (
    IllegitimateModel,
    ModelError,
    ModelFailure,
    TimeAdvanceError,
)
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER
from tests.support.devs_models import Clock, Echo, Log, Scripted, top

BOTH = pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
WRONG = pytest.mark.parametrize("sigma", [-1, 1.0, 0.0, math.nan, math.inf, True, False, None, "1"])


@BOTH
@WRONG
def test_a_wrong_time_advance_after_an_internal_transition(kind: type[Engine], sigma: int) -> None:
    model = Scripted("model", sigma=5 * MILLISECOND)
    model.on_internal = lambda: model.hold_in("odd", sigma)
    simulator = kind(top(model))
    with pytest.raises(TimeAdvanceError) as refusal:
        simulator.run(10 * MILLISECOND)
    assert str(refusal.value) == (
        f"top.model at 0.005000000 s: time advance of phase 'odd' is {sigma!r}; "
        "expected a whole number of nanoseconds, zero or more, or NEVER"
    )
    assert (refusal.value.path, refusal.value.at) == ("top.model", 5 * MILLISECOND)


@BOTH
@WRONG
def test_a_wrong_time_advance_after_an_external_transition(kind: type[Engine], sigma: int) -> None:
    clock, model = Clock("clock", 3), Scripted("model")
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    model.on_external = lambda _elapsed: model.hold_in("odd", sigma)
    with pytest.raises(TimeAdvanceError, match=r"^top\.model at 0\.000000003 s: time advance of"):
        kind(root).run(10)


@BOTH
@WRONG
def test_a_wrong_initial_time_advance(kind: type[Engine], sigma: int) -> None:
    with pytest.raises(TimeAdvanceError, match=r"^top\.model at 0\.000000000 s: time advance of"):
        kind(top(Scripted("model", sigma=sigma)))


def test_continuing_past_the_planned_instant_is_a_negative_time_advance() -> None:
    clock, model = Clock("clock", 3), Scripted("model", sigma=10)
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    model.on_external = lambda elapsed: model.continue_(elapsed + 8)
    with pytest.raises(TimeAdvanceError, match="is -1; expected"):
        Simulator(root).run(10)


@BOTH
def test_an_endless_zero_time_loop_names_the_models_in_it(kind: type[Engine]) -> None:
    ping, pong, clock = Echo("ping"), Echo("pong"), Clock("clock", 7)
    root = top(clock, ping, pong)
    root.couple(clock.ticks, ping.inlet)
    root.couple(ping.outlet, pong.inlet)
    root.couple(pong.outlet, ping.inlet)
    simulator = kind(root, zero_time_limit=1000)
    with pytest.raises(IllegitimateModel) as refusal:
        simulator.run(10)
    assert str(refusal.value) == (
        "top.pong at 0.000000007 s: still imminent after 1000 steps at this instant; "
        "expected some time advance in the loop to be positive"
    )


def test_models_that_loop_together_are_named_together() -> None:
    models = [Scripted(name, sigma=0) for name in "abcd"]
    for model in models:
        model.on_internal = model.activate
    with pytest.raises(IllegitimateModel, match=r"^top\.a at .* together with top\.b, top\.c "):
        Simulator(top(*models), zero_time_limit=10).run(1)


@BOTH
def test_a_long_but_finite_chain_of_zero_time_steps_is_legitimate(kind: type[Engine]) -> None:
    model = Scripted("model", sigma=3)
    model.on_internal = lambda: model.hold_in("", 0 if len(model.calls) < 100 else 5)
    simulator = kind(model, zero_time_limit=100)
    simulator.run(4)
    assert (len(model.calls), simulator.next_at) == (100, 8)


def test_many_models_imminent_at_one_instant_are_no_endless_loop() -> None:
    """A thousand models go one at a time in classic DEVS, and still in one round."""
    clocks = [Clock(f"clock_{number}", 5) for number in range(1000)]
    echoes = [Echo(f"echo_{number}") for number in range(1000)]
    root = top(*clocks, *echoes)
    for clock, echo in zip(clocks, echoes, strict=True):
        root.couple(clock.ticks, echo.inlet)
    simulator = ClassicSimulator(root, zero_time_limit=2)
    simulator.run(5)
    assert simulator.internal_transitions == 2000


@BOTH
def test_a_model_that_waits_its_turn_does_not_hide_an_endless_loop(kind: type[Engine]) -> None:
    """Select would take the looping model first, without end."""
    looping, waiting = Scripted("looping", sigma=0), Scripted("waiting", sigma=0)
    looping.on_internal = looping.activate
    with pytest.raises(IllegitimateModel, match=r"^top\.looping at"):
        kind(top(looping, waiting), zero_time_limit=10).run(1)


def fail(*_arguments: object) -> None:
    raise KeyError("reading")


@BOTH
@pytest.mark.parametrize("function", ["on_output", "on_internal", "on_external"])
def test_an_exception_names_model_phase_and_time_and_keeps_its_cause(
    kind: type[Engine], function: str
) -> None:
    clock, model = Clock("clock", 4), Scripted("model", NEVER if function == "on_external" else 4)
    model.phase = "working"
    setattr(model, function, fail)
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    with pytest.raises(ModelFailure) as failure:
        kind(root).run(4)
    assert str(failure.value) == (
        "top.model at 0.000000004 s: raised KeyError in phase 'working': 'reading'"
    )
    assert isinstance(failure.value.__cause__, KeyError)


@BOTH
def test_an_exception_in_initialize_names_the_model(kind: type[Engine]) -> None:
    class Broken(Log):
        def initialize(self) -> None:
            fail()

    with pytest.raises(ModelFailure, match=r"^top\.broken at 0\.000000000 s: raised KeyError"):
        kind(top(Log("log"), Broken("broken")))


def test_an_exception_in_an_own_confluent_function_names_the_model() -> None:
    class Broken(Scripted):
        confluent: Callable[[], None] = fail

    model = Broken("model", sigma=2)
    simulator = Simulator(model)
    simulator.inject(model.inlet, 1)
    with pytest.raises(ModelFailure, match=r"^model at 0\.000000002 s: raised KeyError"):
        simulator.advance(2)


@BOTH
def test_an_error_that_already_names_a_model_is_not_wrapped(kind: type[Engine]) -> None:
    own = ModelError("tachobot.imu: the sample rate is lower than the control rate")

    def complain() -> None:
        raise own

    model = Scripted("model", sigma=1)
    model.on_internal = complain
    with pytest.raises(ModelError) as failure:
        kind(model).run(1)
    assert failure.value is own
    assert failure.value.__cause__ is None


@BOTH
def test_what_is_no_exception_passes_through(kind: type[Engine]) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    model = Scripted("model", sigma=1)
    model.on_internal = interrupt
    with pytest.raises(KeyboardInterrupt):
        kind(model).run(1)
