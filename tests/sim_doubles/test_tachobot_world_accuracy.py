"""The plant against a tight numerical solution of equation (1), and as quantized integrators."""

import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from firmware_runtime import open_board
from sim_doubles.worlds.quantized import QUANTA, QuantizedSolver
from sim_doubles.worlds.tachobot import TachobotParameters, TachobotState, TachobotWorld

pytestmark = pytest.mark.slow

Vector = NDArray[np.float64]
Stretch = tuple[int, list[float]]
"""A duration in ns and the duties that hold for it."""

FIVE_SECONDS = 5_000_000_000
CASES = {
    "frictionless": TachobotParameters(),
    "no lag": TachobotParameters(motor_lag_s=0.0),
    "quick motors": TachobotParameters(motor_lag_s=0.01),
    "viscous": TachobotParameters(yaw_damping_nms=0.02, motor_lag_s=0.1),
    "damping as quick as the motors": TachobotParameters(yaw_damping_nms=2.5, motor_lag_s=0.03),
    "dry": TachobotParameters(static_friction_nm=0.06, coulomb_friction_nm=0.03),
    "static equals Coulomb": TachobotParameters(static_friction_nm=0.05, coulomb_friction_nm=0.05),
    "static without Coulomb": TachobotParameters(static_friction_nm=0.04),
    "viscous and dry": TachobotParameters(
        static_friction_nm=0.06, coulomb_friction_nm=0.04, yaw_damping_nms=0.01, motor_lag_s=0.1
    ),
    "dry without lag": TachobotParameters(
        static_friction_nm=0.06, coulomb_friction_nm=0.04, motor_lag_s=0.0
    ),
    "free": TachobotParameters(mounting="free"),
    "free, quick motors": TachobotParameters(mounting="free", motor_lag_s=0.01),
    "free, slow motors": TachobotParameters(mounting="free", motor_lag_s=0.1),
    "free, no lag": TachobotParameters(mounting="free", motor_lag_s=0.0),
}
every_case = pytest.mark.parametrize("parameters", CASES.values(), ids=CASES.keys())


class Reference:
    """Equation (1) with its motors and its bearing, by DOP853 with events."""

    def __init__(self, parameters: TachobotParameters) -> None:
        self.p = parameters
        self.state: Vector = np.zeros(14)  # six of the body, eight effective duties
        self.direction = 0
        self.dry = parameters.mounting == "platform" and parameters.static_friction_nm > 0

    def advance(self, duration: int, duties: Sequence[float]) -> Vector:
        """The body's state after holding the duties for a duration in ns."""
        target = np.asarray(duties)
        if self.p.motor_lag_s == 0:
            self.state[6:] = target
        t, end = 0.0, duration * 1e-9
        while t < end:
            t = self._leg(t, end, target)
        return self.state[:6]

    def _leg(self, t: float, end: float, target: Vector) -> float:
        """Integrate until the bearing stops or breaks away, or to the end."""
        if self._sticks() and abs(self._moment(self.state)) > self.p.static_friction_nm:
            self._break_away()
        solution = solve_ivp(
            lambda _t, z: self._derivative(z, target),
            (t, end),
            self.state,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
            max_step=0.005 if self.dry else np.inf,  # two events in one step stay unseen
            events=[self._event()] if self.dry else None,
        )
        self.state = solution.y[:, -1]
        if solution.status == 1:
            self._break_away() if self._sticks() else self._stop()
        return float(solution.t[-1])

    def _sticks(self) -> bool:
        return self.dry and self.direction == 0

    def _break_away(self) -> None:
        self.direction = 1 if self._moment(self.state) > 0 else -1

    def _stop(self) -> None:
        self.state[5] = 0.0
        self.direction = 0

    def _event(self) -> Callable[[float, Vector], float]:
        def breaks_away(_t: float, z: Vector) -> float:
            return abs(self._moment(z)) - self.p.static_friction_nm

        def stops(_t: float, z: Vector) -> float:
            return -self.direction * float(z[5])

        event: Any = breaks_away if self._sticks() else stops
        event.terminal, event.direction = True, 1.0
        return event  # type: ignore[no-any-return]

    def _forces(self, z: Vector) -> Vector:
        thrust = self.p.pair_thrust_n * z[6:] ** 2
        return thrust[0::2] - thrust[1::2]

    def _moment(self, z: Vector) -> float:
        return self.p.lever_arm_m * float(np.array([1, -1, 1, -1]) @ self._forces(z))

    def _derivative(self, z: Vector, target: Vector) -> Vector:
        slope = np.zeros(14)
        if self.p.motor_lag_s > 0:
            slope[6:] = (target - z[6:]) / self.p.motor_lag_s
        if self.p.mounting == "free":
            c, s = np.cos(z[4]), np.sin(z[4])
            push = np.array([[c, s, -c, -s], [s, -c, -s, c]]) @ self._forces(z) / self.p.mass_kg
            slope[0], slope[2] = z[1], z[3]
            slope[1], slope[3] = push
            slope[4], slope[5] = z[5], self._moment(z) / self.p.yaw_inertia_kg_m2
        elif not self._sticks():
            resistance = self.p.yaw_damping_nms * z[5] + self.direction * self.p.coulomb_friction_nm
            slope[4] = z[5]
            slope[5] = (self._moment(z) - resistance) / self.p.yaw_inertia_kg_m2
        return slope


def random_stretches(seed: int) -> Iterator[Stretch]:
    """Five seconds of duties, some full, some equal, held for 3 to 150 ms at odd instants."""
    choice = np.random.default_rng(seed)
    left = FIVE_SECONDS
    while left > 0:
        duration = min(left, int(choice.integers(3_000_001, 150_000_001)))
        left -= duration
        yield duration, [float(choice.choice((0.0, 0.5, 1.0, choice.random()))) for _ in range(8)]


def follow(
    parameters: TachobotParameters, stretches: Sequence[Stretch], reads: int
) -> list[TachobotState]:
    """The state at the end of each stretch, the plant being read at odd instants inside it."""
    choice = np.random.default_rng(reads)
    duties: list[float] = [0.0] * 8
    world = TachobotWorld(parameters, lambda: duties)
    at, states = 0, []
    for duration, new_duties in stretches:
        duties = new_duties
        for inside in sorted(choice.integers(duration, size=reads).tolist()):
            world.advance(at + inside)
        at += duration
        states.append(world.state(at))
    return states


@every_case
def test_five_seconds_of_random_duties_stay_within_a_millionth_of_a_tight_solution(
    parameters: TachobotParameters,
) -> None:
    stretches = list(random_stretches(seed=7))
    reference = Reference(parameters)
    expected = [reference.advance(*stretch).copy() for stretch in stretches]
    states = follow(parameters, stretches, reads=2)
    assert np.abs(np.array(states) - np.array(expected)).max() < 1e-6
    assert np.ptp(np.array(states)[:, 4]) > 0.01  # it did turn


@every_case
def test_the_motion_does_not_depend_on_how_often_it_is_read_and_the_same_calls_give_the_same_bits(
    parameters: TachobotParameters,
) -> None:
    stretches = list(random_stretches(seed=11))
    seldom, often, again = (follow(parameters, stretches, reads) for reads in (0, 9, 9))
    assert np.abs(np.array(seldom) - np.array(often)).max() < 1e-9
    assert often == again


SECOND = 1_000_000_000
DRY = TachobotParameters(static_friction_nm=0.06, coulomb_friction_nm=0.03)
QUANTIZED = ("frictionless", "no lag", "viscous", "dry", "dry without lag", "free")


@pytest.mark.parametrize("solver", ["qss2", "qss3"])
@pytest.mark.parametrize("case", [*QUANTIZED, "static equals Coulomb"])
def test_both_move_alike_within_the_quantum_whatever_the_motors_get(
    case: str, solver: QuantizedSolver
) -> None:
    parameters = CASES[case]
    generator, duties = random.Random(7), [0.5] * 8  # noqa: S311
    exact = TachobotWorld(parameters, lambda: duties)
    quantized = TachobotWorld(replace(parameters, solver=solver), lambda: duties)
    at, has_moved = 0, False
    for _ in range(40):
        at += generator.randrange(1, 30_000_000)
        state = exact.state(at)
        assert quantized.state(at) == pytest.approx(state, rel=0.0, abs=2.0 * QUANTA["yaw"])
        seen, felt = quantized.motion(at), exact.motion(at)
        assert seen.acceleration == pytest.approx(felt.acceleration, abs=1e-9)
        has_moved = has_moved or abs(state.yaw_rad) > 100.0 * QUANTA["yaw"]
        if generator.random() < 0.7:
            duties = [generator.random() for _ in range(8)]
    assert has_moved


def test_a_bearing_that_sticks_does_not_move_at_all() -> None:
    duties = [0.5] * 8
    world = TachobotWorld(replace(DRY, solver="qss3"), lambda: duties)
    assert world.state(SECOND)[4:] == (0.0, 0.0)
    duties = [0.55, 0.45, 0.45, 0.55] * 2  # 0.032 N m
    assert world.state(3 * SECOND)[4:] == (0.0, 0.0)


def test_a_yaw_step_of_the_whole_robot_is_the_same_on_either_plant() -> None:
    yaws: dict[str, list[float]] = {}
    for solver in ("exact", "qss2"):
        chosen = {"world.static_friction_nm": 0.01, "world.coulomb_friction_nm": 0.005}
        settings = {**chosen, "world.solver": solver}
        with open_board("tachobot", doubles=True, clock="virtual", set=settings) as board:
            yaws[solver] = []
            for _ in range(20):
                board.run(0.1)
                yaws[solver].append(board.world.state(board.now).yaw_rad)
    apart = [abs(a - b) for a, b in zip(yaws["exact"], yaws["qss2"], strict=True)]
    assert max(yaws["exact"]) > 0.3
    assert 0.0 < max(apart) < 1e-3
