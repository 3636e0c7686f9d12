"""The predictor in loops whose plant is known exactly, in virtual time."""

from dataclasses import dataclass
from itertools import pairwise

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.delay import Delay
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.models.pid import Pid, PidGains
from firmware_runtime.models.plant import PlantModel, SecondOrderPlant, State
from firmware_runtime.models.smith_predictor import SmithPredictor
from tests.support.atomic_bench import AtomicBench

PERIOD = 10 * MILLISECOND
BODY = SecondOrderPlant(gain=5.0, damping_per_s=0.3, lag_s=0.03)
GAINS = PidGains(kp=1.5, ki=0.2, kd=0.8, limit=5.0)


@dataclass(frozen=True)
class Tank:
    """A plant of another kind, which comes to rest by itself: its position follows the command."""

    time_constant_s: float = 0.2
    rest: State = (0.0, 0.0)

    def after(self, state: State, command: float, elapsed_s: float) -> State:
        share = 2.718281828459045 ** (-elapsed_s / self.time_constant_s)
        position = command + (state[0] - command) * share
        return (position, (command - position) / self.time_constant_s)


class Plant(Atomic):
    """A plant that is measured every period; `disturbance` is added to what commands it."""

    def __init__(self, model: PlantModel, disturbance: float) -> None:
        super().__init__("plant")
        self.command = self.in_port("command", float)
        self.measured = self.out_port("measured", Motion)
        self.model, self.state, self.disturbance = model, model.rest, disturbance
        self.held = 0.0
        self.until = 0

    def initialize(self) -> None:
        self.activate("measuring")

    def output(self) -> None:
        self.measured.send(Motion(*self.after(self.until)[:2]))

    def internal(self) -> None:
        self.advance(self.until)
        self.until = PERIOD
        self.hold_in("measuring", PERIOD)

    def external(self, elapsed: int) -> None:
        self.advance(elapsed)
        self.until -= elapsed
        self.held = self.command[-1]
        self.continue_(elapsed)

    def advance(self, elapsed: int) -> None:
        self.state = self.after(elapsed)

    def after(self, elapsed: int) -> State:
        return self.model.after(self.state, self.held + self.disturbance, elapsed / SECOND)


def test_a_body_that_moves_without_a_command_is_predicted_to_move_on() -> None:
    bench = AtomicBench(SmithPredictor("predictor", BODY, 100 * MILLISECOND))
    bench.put(0, measurement=Motion(0.0, 1.0))
    bench.put(900, command=1.0)
    bench.put(1000, measurement=Motion(0.0, 1.0), applied=Applied.NOTHING)
    bench.run(1001)
    expected = BODY.after((0.0, 1.0, 0.0), 0.0, 0.1)[:2]
    assert bench.values("predicted") == [pytest.approx(expected)] * 2


@dataclass
class Watched:
    measured: list[float]
    predicted: list[float]


def loop(
    model: PlantModel,
    delay_ms: int,
    predictor: SmithPredictor | None,
    *,
    gains: PidGains = GAINS,
    disturbance: float = 0.0,
    for_s: float = 4.0,
) -> Watched:
    """A PID that turns a plant to 1 through a delay, behind a predictor or not."""
    top = Coupled("top")
    plant, pid = top.add(Plant(model, disturbance)), top.add(Pid("pid", gains, 1.0))
    delay = top.add(Delay("delay", float, delay_ms * MILLISECOND))
    top.couple(pid.command, delay.entrance)
    top.couple(delay.delayed, plant.command)
    seen = Watched([], [])
    if predictor is None:
        top.couple(plant.measured, pid.measurement)
    else:
        top.add(predictor)
        top.couple(plant.measured, predictor.measurement)
        top.couple(predictor.predicted, pid.measurement)
        top.couple(pid.command, predictor.command)
    simulator = Simulator(top, checked=True)
    simulator.listen(plant.measured, lambda _, value: seen.measured.append(value.position))
    if predictor is not None:
        simulator.listen(predictor.predicted, lambda _, to: seen.predicted.append(to.position))
    simulator.run(round(for_s * SECOND))
    return seen


def smith(model: PlantModel, delay_ms: int, *, from_measurement: bool = True) -> SmithPredictor:
    delay = delay_ms * MILLISECOND
    return SmithPredictor("smith", model, delay, from_measurement=from_measurement)


@pytest.mark.parametrize("delay_ms", [80, 83])
@pytest.mark.parametrize("from_measurement", [True, False])
def test_with_an_exact_model_the_loop_is_the_one_without_delay_only_later(
    delay_ms: int, *, from_measurement: bool
) -> None:
    without = loop(BODY, 0, None).measured
    with_it = loop(BODY, delay_ms, smith(BODY, delay_ms, from_measurement=from_measurement))
    assert with_it.predicted == pytest.approx(without, abs=1e-9)
    if delay_ms == 80:
        assert with_it.measured[8:] == pytest.approx(without[:-8], abs=1e-9)


def test_gains_that_oscillate_behind_the_delay_do_not_behind_the_predictor() -> None:
    gains = PidGains(kp=12.0, ki=0.0, kd=3.0, limit=100.0)
    assert max(loop(BODY, 80, None, gains=gains).measured) > 2.0
    assert max(loop(BODY, 80, smith(BODY, 80), gains=gains).measured) < 1.3


def test_a_delay_of_nothing_predicts_what_was_measured() -> None:
    with_it = loop(BODY, 0, smith(BODY, 0), for_s=0.5)
    assert with_it.measured == loop(BODY, 0, None, for_s=0.5).measured


def test_a_plant_that_comes_to_rest_is_predicted_without_offset_by_a_model_on_its_own() -> None:
    gains = PidGains(kp=0.5, ki=4.0, kd=0.0, limit=5.0)
    predictor = smith(Tank(), 80, from_measurement=False)
    assert loop(Tank(), 80, predictor, gains=gains, disturbance=0.3).measured[-1] == pytest.approx(
        1.0, abs=1e-3
    )


@pytest.mark.slow
def test_begun_from_the_measurement_a_disturbance_costs_what_it_does_within_one_delay() -> None:
    body = SecondOrderPlant(gain=5.0)
    gains = PidGains(kp=1.5, ki=1.0, kd=0.8, limit=5.0)
    seen = loop(body, 80, smith(body, 80), gains=gains, disturbance=0.3, for_s=20.0)
    assert seen.measured[-1] == pytest.approx(1.0 + 0.3 * 5.0 * 0.08**2 / 2, abs=1e-4)


@pytest.mark.slow
def test_a_model_on_its_own_drifts_away_from_a_body_that_nothing_brings_to_rest() -> None:
    body = SecondOrderPlant(gain=5.0)
    seen = loop(body, 80, smith(body, 80, from_measurement=False), disturbance=0.3, for_s=20.0)
    late = [b - a for a, b in pairwise(seen.measured[-500::100])]
    assert all(abs(step) > 0.01 for step in late)


@pytest.mark.parametrize("delay", [-1, 0.5, True])
def test_a_delay_that_is_no_whole_number_of_ns_is_refused(delay: int) -> None:
    with pytest.raises(ModelError, match="expected whole ns"):
        SmithPredictor("smith", BODY, delay)
