"""Robots that something holds: none moves, and none that is driven without effect keeps silent."""

from pathlib import Path

import pytest

from firmware_runtime import OpenBoard, Strike, open_board
from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.worlds.propellers import PropellerPairs
from sim_doubles.worlds.quantized import QuantizedBody
from sim_doubles.worlds.servo import ServoParameters, ServoPlant
from sim_doubles.worlds.tachobot import Body
from sim_doubles.worlds.tachobot_body import Hovering, TachobotParameters, Turntable

EXAMPLES = Path(__file__).parents[2] / "examples"

_OTHERS = ("rate_rad_s", "x", "y", "error_rad")


def place(robot: OpenBoard) -> list[object]:
    """Where it truly is, without rates, and without what moves of itself."""
    truth = robot.rig.truth()  # type: ignore[union-attr]
    return [value for path, value in truth.items() if not path.endswith(_OTHERS)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("board", "settings"),
    [
        ("tachobot", {}),
        ("tachobot", {"world.solver": "qss2"}),
        ("tachobot", {"world.static_friction_nm": 0.02, "world.coulomb_friction_nm": 0.01}),
        ("detective", {}),
        ("detective", {"world.solver": "qss2"}),
        (str(EXAMPLES / "pan_tilt" / "pan_tilt"), {}),
        (str(EXAMPLES / "balancing" / "balancing"), {}),
    ],
)
def test_what_is_held_stands_still_and_moves_when_it_is_let_go(
    board: str, settings: dict[str, object]
) -> None:
    held = Strike("hold", at_s=0.9, for_s=0.5)
    with open_board(board, doubles=True, clock="virtual", set=settings, faults=[held]) as robot:
        robot.run(0.92)
        begin = place(robot)
        robot.run(0.45)
        assert place(robot) == begin
        robot.run(1.5)
        assert place(robot) != begin


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["exact", "qss2"])
def test_tachobot_is_off_while_it_is_held_and_turns_to_its_reference_afterwards(
    solver: str,
) -> None:
    held = Strike("hold", at_s=0.5, for_s=3.0)
    settings = {"world.solver": solver}
    with open_board(
        "tachobot", doubles=True, clock="virtual", set=settings, faults=[held]
    ) as robot:
        robot.run(1.4)
        assert robot.outputs == {"thrust_pairs": 0}
        fault = robot.statistics.faults["controller.movement_check"]
        assert list(fault) == ["Implausible"]
        robot.run(6.0)
        assert robot.result["settled"]


@pytest.mark.slow
def test_tachobot_that_hovers_and_is_held_stands_still_and_goes_on() -> None:
    settings = {"controller.mode": "free"}
    held = Strike("hold", at_s=3.2, for_s=1.0)
    with open_board(
        "tachobot", doubles=True, clock="virtual", set=settings, faults=[held]
    ) as robot:
        robot.run(3.3)
        begin = robot.rig.truth()  # type: ignore[union-attr]
        robot.run(0.8)
        assert robot.rig.truth() == begin  # type: ignore[union-attr]
        assert "controller.movement_check" in robot.statistics.faults


@pytest.mark.slow
def test_a_reload_of_the_same_settings_changes_nothing() -> None:
    ends = []
    for faults in ([], [Strike("reload", at_s=at) for at in (0.3, 1.0, 1.504, 2.2)]):
        with open_board("tachobot", doubles=True, clock="virtual", faults=faults) as robot:
            robot.run(3.0)
            ends.append(robot.rig.truth())  # type: ignore[union-attr]
            assert robot.session.tuning.revision == len(faults)
    assert ends[0] == ends[1]


@pytest.mark.slow
def test_a_hold_without_end_is_over_when_faults_are_cleared() -> None:
    with open_board("detective", doubles=True, clock="virtual") as robot:
        robot.strike("hold")
        robot.run(0.2)
        begin = place(robot)
        robot.run(0.3)
        assert place(robot) == begin
        robot.clear_faults()
        robot.run(1.0)
        assert place(robot) != begin


def test_a_body_that_was_held_goes_on_as_its_propellers_drive_it_by_now() -> None:
    """A bearing that held while something else did breaks away when that lets go."""
    parameters = TachobotParameters(static_friction_nm=0.02, coulomb_friction_nm=0.01)
    closed, quantized = Turntable(parameters), QuantizedBody(parameters, "qss3")
    bodies: tuple[Body, ...] = (closed, quantized)
    for body in bodies:
        propellers = PropellerPairs(parameters.pair_thrust_n, parameters.motor_lag_s)
        propellers.hold((1.0, 0.0, 0.0, 1.0) * 2)
        body.advance(propellers, 0.3)
        body.hold(is_held=True)
        body.advance(propellers, 0.2)
        assert body.turn[1] == 0.0
        body.hold(is_held=False)
        body.advance(propellers, 0.3)
    assert closed.turn == pytest.approx(quantized.turn, abs=1e-3)
    assert closed.turn[1] > 0.1


def test_a_hovering_body_that_is_held_feels_no_acceleration() -> None:
    parameters = TachobotParameters(mounting="free")
    body = Hovering(parameters)
    propellers = PropellerPairs(parameters.pair_thrust_n, parameters.motor_lag_s)
    propellers.hold((1.0, *[0.0] * 7))
    body.advance(propellers, 0.3)
    assert body.acceleration(lambda: propellers) != (0.0, 0.0)
    body.hold(is_held=True)
    assert body.acceleration(lambda: propellers) == (0.0, 0.0)
    assert body.turn[1] == 0.0


def test_a_servo_that_is_held_turns_on_from_there() -> None:
    pulse_us = 1500.0
    servo = ServoPlant(ServoParameters(), lambda: pulse_us)
    pulse_us = 2500.0
    servo.advance(50 * MILLISECOND)
    servo.hold(is_held=True)
    held = servo.angle_rad(SECOND)
    assert held == servo.angle_rad(50 * MILLISECOND)
    servo.advance(SECOND)
    servo.hold(is_held=False)
    assert servo.angle_rad(SECOND + 10 * MILLISECOND) == pytest.approx(held + 0.087)


def test_a_robot_is_let_go_as_if_the_end_had_been_known_at_first() -> None:
    """Where a use of its bus ends at the very instant, too."""
    held = Strike("hold", at_s=0.9)
    with open_board("tachobot", doubles=True, clock="virtual", faults=[held]) as robot:
        robot.run(1.0)
        hardware = robot.session.hardware
        end = hardware.world_now()
        assert end > SECOND
        hardware.struck.end(end)
        robot.run(0.5)
        truth = robot.rig.truth()  # type: ignore[union-attr]
    known = Strike("hold", at_s=0.9, for_s=(end - 900 * MILLISECOND) / SECOND)
    with open_board("tachobot", doubles=True, clock="virtual", faults=[known]) as robot:
        robot.run(1.5)
        assert robot.rig.truth() == truth  # type: ignore[union-attr]
