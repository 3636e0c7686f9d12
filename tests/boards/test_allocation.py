import numpy as np
import pytest
from firmware_boards.tachobot.allocation import T_PSEUDO_INVERSE, Allocation, T, allocate
from firmware_drivers.thrust_pairs import Forces
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Motion

COMMANDS = st.floats(-5.0, 5.0)
LIMIT_N = 0.4
MATRIX = np.array(T)


def test_the_pseudo_inverse_is_the_papers() -> None:
    expected = [[0.5, 0, 0.5], [0, -0.5, -0.5], [-0.5, 0, 0.5], [0, 0.5, -0.5]]
    assert pytest.approx(np.array(expected), abs=1e-15) == np.array(T_PSEUDO_INVERSE)
    assert pytest.approx(np.linalg.pinv(T), abs=1e-15) == np.array(T_PSEUDO_INVERSE)


def test_commands_within_reach_are_met_exactly() -> None:
    forces = allocate(0.1, -0.2, 0.3, LIMIT_N)[0]
    assert pytest.approx([0.1, -0.2, 0.3], abs=1e-15) == MATRIX @ forces


@given(COMMANDS, COMMANDS, COMMANDS)
def test_no_pair_is_commanded_beyond_its_limit(x: float, y: float, yaw: float) -> None:
    assert max(map(abs, allocate(x, y, yaw, LIMIT_N)[0])) <= LIMIT_N * (1 + 1e-12)


@given(COMMANDS, COMMANDS, COMMANDS)
def test_saturation_keeps_the_yaw_command(x: float, y: float, yaw: float) -> None:
    reachable = max(-2 * LIMIT_N, min(2 * LIMIT_N, yaw))
    assert (MATRIX @ allocate(x, y, yaw, LIMIT_N)[0])[2] == pytest.approx(reachable, abs=1e-12)


@given(COMMANDS, COMMANDS, COMMANDS)
def test_saturation_keeps_the_direction_of_x_and_y(x: float, y: float, yaw: float) -> None:
    got = MATRIX @ allocate(x, y, yaw, LIMIT_N)[0]
    assert got[0] * y == pytest.approx(got[1] * x, abs=1e-9)
    assert got[0] * x + got[1] * y >= -1e-12


class Rig:
    def __init__(self) -> None:
        top = Coupled("top")
        model = top.add(Allocation("allocation", LIMIT_N, timeout=100 * MILLISECOND))
        self.x, self.yaw_n = top.in_port("x_n", float), top.in_port("yaw_n", float)
        self.yaw = top.in_port("yaw", Motion)
        top.couple(self.x, model.x_n)
        top.couple(self.yaw_n, model.yaw_n)
        top.couple(self.yaw, model.yaw)
        self.simulator = Simulator(top, checked=True)
        self.forces: list[Forces] = []
        self.simulator.listen(model.forces_out, lambda _at, forces: self.forces.append(forces))

    def command_yaw(self, at_ms: int, yaw_n: float) -> Forces:
        self.simulator.inject(self.yaw_n, yaw_n)
        self.simulator.advance(at_ms * MILLISECOND)
        return self.forces[-1]


def test_a_position_command_turns_with_the_body() -> None:
    rig = Rig()
    rig.simulator.inject(rig.yaw, Motion(np.pi / 2, 0.0))
    rig.simulator.inject(rig.x, 0.2)
    forces = rig.command_yaw(0, 0.0)
    assert forces == pytest.approx((0.0, 0.1, 0.0, -0.1), abs=1e-15)


def test_a_position_command_that_is_not_renewed_counts_as_zero() -> None:
    rig = Rig()
    rig.simulator.inject(rig.x, 0.2)
    assert rig.command_yaw(0, 0.0).f1 == pytest.approx(0.1)
    assert rig.command_yaw(100, 0.0).f1 == pytest.approx(0.1)
    assert rig.command_yaw(101, 0.0).f1 == 0.0
