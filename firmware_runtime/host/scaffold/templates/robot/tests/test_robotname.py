"""The robot, whole, on its doubles in virtual time."""

import pytest
from firmware_drivers.dc_motor import DcMotor

from firmware_runtime import SECOND, ConfigError, OpenBoard, open_board, run
from sim_doubles.faults import FaultScript, NackAddress

from robotname.controller import Mode
from robotname.rig import RobotNameRig

SONAR = 0x71


def on_doubles(**numbers: float) -> OpenBoard:
    """The robot on doubles of its chips, with these numbers of the table [world]."""
    world = {f"world.{key}": value for key, value in numbers.items()}
    return open_board("robotname", doubles=True, clock="virtual", set=world)


def rig_of(robot: OpenBoard) -> RobotNameRig:
    """The doubles, and the world behind them."""
    assert isinstance(robot.rig, RobotNameRig)
    return robot.rig


@pytest.mark.parametrize("start_m", [0.2, 0.5, 2.0, 2.9])
def test_it_stops_at_its_distance_from_the_wall(start_m: float) -> None:
    with on_doubles(start_m=start_m) as robot:
        robot.run(20.0)
        assert robot.result["distance_m"] == pytest.approx(0.5, abs=0.03)
        assert robot.result["settled"] is True
        assert rig_of(robot).pwm.warnings == []
        assert rig_of(robot).sonar.warnings == []
    assert rig_of(robot).outputs == {"motor": 0}


def test_a_motor_that_would_not_wait_for_the_next_echo_is_refused() -> None:
    with pytest.raises(ConfigError) as caught:
        open_board("robotname", doubles=True, set={"motor.timeout_s": 0.1})
    assert caught.value.faults[0].startswith("motor.timeout_s: ")


def test_another_distance_can_be_asked_for_on_the_way() -> None:
    with on_doubles() as robot:
        robot.plan(10.0, robot.model.in_ports["distance_m"], 0.8)
        robot.run(25.0)
        assert robot.result["distance_m"] == pytest.approx(0.8, abs=0.03)
        assert (robot.result["asked_m"], robot.result["settled"]) == (0.8, True)


def test_it_waits_where_no_wall_is_within_range() -> None:
    with on_doubles(start_m=8.0) as robot:
        robot.run(3.0)
        assert robot.result == {"distance_m": 8.0, "asked_m": 0.5, "settled": False}


def test_the_sonar_is_woken_until_there_is_a_wall() -> None:
    woken_at: list[int] = []
    mode = Mode("mode", lost=SECOND)
    run(mode, for_s=2.5, clock="virtual", listen={mode.sonar: lambda at, _: woken_at.append(at)})
    assert woken_at == [0, SECOND, 2 * SECOND]


def test_a_sonar_that_falls_silent_on_the_way_stops_it() -> None:
    silent = NackAddress(address=SONAR, times=None, since=1 * SECOND)
    with on_doubles() as robot:
        rig_of(robot).buses["i2c1"].faults = FaultScript([silent])
        robot.run(20.0)
        assert robot.result["distance_m"] == pytest.approx(1.5, abs=0.3)
        assert robot.world.speed_m_s == pytest.approx(0.0, abs=1e-6)


def answer_after(disarmed_s: float) -> list[float]:
    """The distances of a robot that was kept from driving for so long, from then on."""
    gains = {"controller.ki": 0.5, "world.start_m": 1.5}
    with open_board("robotname", doubles=True, clock="virtual", set=gains) as robot:
        motor = robot.model.components["motor"]
        assert isinstance(motor, DcMotor)
        motor.interlock = lambda: robot.now >= disarmed_s * SECOND
        robot.run(disarmed_s)
        seen = []
        for _ in range(50):
            robot.run(0.1)
            seen.append(robot.world.distance_m)
        return seen


def test_time_spent_disarmed_changes_no_later_answer() -> None:
    assert answer_after(50.0) == pytest.approx(answer_after(1.0), rel=0.01)
