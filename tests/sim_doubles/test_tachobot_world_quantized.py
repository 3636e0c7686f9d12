"""TachoBot's plant as a DEVS model of quantized integrators, against its closed forms."""

import random

import pytest
from msgspec.structs import replace

from firmware_runtime import open_board
from sim_doubles.worlds.quantized import QUANTA, QuantizedSolver
from sim_doubles.worlds.tachobot import TachobotParameters, TachobotWorld

SECOND = 1_000_000_000
DRY = TachobotParameters(static_friction_nm=0.06, coulomb_friction_nm=0.03)
CASES = {
    "frictionless": TachobotParameters(),
    "no lag": TachobotParameters(motor_lag_s=0.0),
    "viscous": TachobotParameters(yaw_damping_nms=0.02, motor_lag_s=0.1),
    "dry": DRY,
    "dry without lag": replace(DRY, motor_lag_s=0.0),
    "static equals Coulomb": TachobotParameters(static_friction_nm=0.05, coulomb_friction_nm=0.05),
    "free": TachobotParameters(mounting="free"),
}


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["qss2", "qss3"])
@pytest.mark.parametrize("parameters", CASES.values(), ids=CASES.keys())
def test_both_move_alike_within_the_quantum_whatever_the_motors_get(
    parameters: TachobotParameters, solver: QuantizedSolver
) -> None:
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


@pytest.mark.slow
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
