"""Time in which commands have no effect changes no later answer: every board and example, each way.

A robot is kept from acting for a while, from the start or in mid run, and then let go. How it
answers from then on is compared with the answer of one that was let go at once.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest
from firmware_drivers.chips.liveness import Liveness, MeanSquare

from firmware_runtime import SECOND, OpenBoard, open_board
from firmware_runtime.devs.coupled import with_all_below
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.faults import FaultScript, NackAddress
from tests.support.virtual_detective import virtual_detective

pytestmark = pytest.mark.slow

See = Callable[[OpenBoard], float]
Span = tuple[float, float]
"""From when to when outputs are off, s."""
SAME = 0.01
"""Of the greatest answer."""

QUIET = {
    "controller.yaw.reference_rad": 0.3,
    "world.gyro_noise_rad_s": 0.0,
    "world.gyro_bias_rad_s": 0.0,
    "world.field_noise_t": 0.0,
}
"""TachoBot without noise, so that answers can be compared."""
BEARING = {"world.yaw_damping_nms": 0.05}
"""A bearing that stops it where it is switched off, or it would turn on."""
SMITH = {"controller.yaw.delay_s": 0.08, "controller.yaw.smith.delay_s": 0.08}
CUT_AT_S = 10.0
"""When a robot has come to rest, and is cut off in mid run."""
WINDING = {"controller.yaw.ki": 0.2}
"""An integral of which one sees what it has learned."""


@pytest.fixture(autouse=True)
def _exact_sensors(monkeypatch: pytest.MonkeyPatch) -> None:
    """No noise, by which two answers would differ, and no check that a sensor has some."""
    monkeypatch.setattr(Liveness, "check", lambda _self, _counts: None)
    monkeypatch.setattr(MeanSquare, "check", lambda _self, *_: None)
    defaults = Mpu9250Double.__init__.__kwdefaults__
    assert defaults is not None
    monkeypatch.setitem(defaults, "noise_seed", None)


def let_go_outside(robot: OpenBoard, spans: Sequence[Span]) -> None:
    """Enable the outputs of every actuator but in these spans."""

    def is_enabled() -> bool:
        now_s = robot.now / SECOND
        return not any(begin <= now_s < end for begin, end in spans)

    for model in with_all_below(robot.model):
        if hasattr(model, "interlock"):
            model.interlock = is_enabled


def answered(robot: OpenBoard, since_s: float, see: See, for_s: float) -> list[float]:
    """What is seen every tenth of a second since an instant."""
    if (left_s := since_s - robot.now / SECOND) > 0:
        robot.run(left_s)
    seen = []
    for _ in range(round(for_s * 10)):
        robot.run(0.1)
        seen.append(see(robot))
    return seen


def apart(one: Sequence[float], other: Sequence[float]) -> float:
    """The greatest difference of two answers, as a share of the greatest answer."""
    most = max(map(abs, one))
    return max(abs(a - b) for a, b in zip(one, other, strict=True)) / most


def rig_of(robot: OpenBoard) -> Any:  # noqa: ANN401 -- a rig is of its board's own class
    return robot.rig


def yaw_of(robot: OpenBoard) -> float:
    return float(robot.world.state(robot.now).yaw_rad)


def disarmed_first(
    board: str, settings: Mapping[str, object], wait_s: float, see: See, for_s: float
) -> list[float]:
    """The answer of a robot that waits disarmed, calibrated, for so long."""
    begin_s = 2.0 + wait_s
    with open_board(board, doubles=True, clock="virtual", set=dict(settings)) as robot:
        let_go_outside(robot, [(0.0, begin_s)])
        return answered(robot, begin_s, see, for_s)


@pytest.mark.parametrize(
    ("settings", "wait_s"),
    [
        ({}, 40.0),
        (WINDING, 10.0),
        ({**WINDING, **SMITH}, 10.0),
        ({**WINDING, "thrust_pairs.slew_per_s": 2.0}, 10.0),
        ({**WINDING, "controller.mode": "free"}, 10.0),
    ],
    ids=["shipped", "winding", "smith", "slew", "free"],
)
def test_tachobot_answers_as_if_it_had_been_armed_at_once(
    settings: dict[str, object], wait_s: float
) -> None:
    chosen = {**QUIET, **settings}
    at_once = disarmed_first("tachobot", chosen, 0.0, yaw_of, 10.0)
    waited = disarmed_first("tachobot", chosen, wait_s, yaw_of, 10.0)
    assert max(at_once) > 0.3
    assert apart(at_once, waited) < SAME


def cut_in_mid_run(cut_s: float, settings: Mapping[str, object]) -> list[float]:
    """TachoBot's answer to a reference that was sent while it was disarmed in mid run."""
    chosen = {**QUIET, **BEARING, **WINDING, **settings}
    with open_board("tachobot", doubles=True, clock="virtual", set=chosen) as robot:
        let_go_outside(robot, [(CUT_AT_S, CUT_AT_S + cut_s)])
        robot.plan(CUT_AT_S + cut_s / 2, robot.model.in_ports["yaw_reference"], 0.9)
        return answered(robot, CUT_AT_S + cut_s, yaw_of, 10.0)


@pytest.mark.parametrize(
    ("settings", "cut_s"), [({}, 40.0), (SMITH, 15.0)], ids=["shipped", "smith"]
)
def test_tachobot_cut_off_in_mid_run_answers_as_after_a_moment(
    settings: dict[str, object], cut_s: float
) -> None:
    assert apart(cut_in_mid_run(5.0, settings), cut_in_mid_run(cut_s, settings)) < SAME


def silent_in_mid_run(address: int, silent_s: float) -> list[float]:
    """TachoBot's answer after a chip was silent, with a reference that came meanwhile."""
    chosen = {**QUIET, **BEARING, **WINDING}
    silent = NackAddress(
        address=address,
        times=None,
        since=round(CUT_AT_S * SECOND),
        until=round((CUT_AT_S + silent_s) * SECOND),
    )
    with open_board("tachobot", doubles=True, clock="virtual", set=chosen) as robot:
        rig_of(robot).buses["i2c1"].faults = FaultScript([silent])
        robot.plan(CUT_AT_S + 2.0, robot.model.in_ports["yaw_reference"], 0.9)
        # A chip that was silent is brought up again at instants of its own.
        robot.run(CUT_AT_S + silent_s)
        before = yaw_of(robot)
        for _ in range(1000):
            if abs(yaw_of(robot) - before) >= 0.01:
                break
            robot.run(0.01)
        return answered(robot, robot.now / SECOND, yaw_of, 10.0)


@pytest.mark.parametrize("address", [0x40, 0x68], ids=["thrust_pairs", "imu"])
def test_a_chip_that_was_silent_for_long_is_as_one_that_was_for_a_moment(address: int) -> None:
    assert apart(silent_in_mid_run(address, 5.0), silent_in_mid_run(address, 20.0)) < SAME


def test_a_path_does_not_run_away_while_tachobot_is_disarmed() -> None:
    quiet = {**QUIET, "world.position.noise_m": 0.0}
    circle = {"trajectory.kind": "circle", "trajectory.radius_m": 0.5, "trajectory.lap_s": 40.0}
    chosen = {**quiet, "controller.mode": "track", **circle}

    def x_of(robot: OpenBoard) -> float:
        return float(robot.world.state(robot.now).x_m)

    at_once = disarmed_first("tachobot", chosen, 0.0, x_of, 20.0)
    waited = disarmed_first("tachobot", chosen, 50.0, x_of, 20.0)
    assert max(at_once) > 0.4
    assert apart(at_once, waited) < SAME


def test_a_wave_waits_for_outputs_that_follow_it() -> None:
    wave = {"amplitude_n": 0.2, "period_s": 4.0, "begin_s": 1.0, "cycles": 2}
    chosen = {**QUIET, **{f"controller.yaw.wave.{key}": value for key, value in wave.items()}}
    at_once = disarmed_first("tachobot", chosen, 0.0, yaw_of, 10.0)
    waited = disarmed_first("tachobot", chosen, 20.0, yaw_of, 10.0)
    assert max(at_once) > 0.1
    assert apart(at_once, waited) < SAME


def test_the_balancing_robot_stands_up_as_if_it_had_been_armed_at_once() -> None:
    winding = {"controller.ki": 4.0, "world.start_pitch_rad": 0.1}

    def place_of(robot: OpenBoard) -> float:
        return float(robot.world.place_m)

    at_once = disarmed_first("balancing", winding, 0.0, place_of, 10.0)
    waited = disarmed_first("balancing", winding, 20.0, place_of, 10.0)
    assert apart(at_once, waited) < SAME


def mission_time_s(cut_s: float, at_s: float, *settings: str) -> float:
    """How long the detective takes to its target, without the time it was cut off on the way."""
    robot = virtual_detective(*settings)

    def is_enabled() -> bool:
        return not at_s <= robot.simulator.now / SECOND < at_s + cut_s

    for model in with_all_below(robot.robot.model):
        if hasattr(model, "interlock"):
            model.interlock = is_enabled
    assert robot.run_mission(600)["found"] is True
    return robot.endings[0][0] / SECOND - cut_s


@pytest.mark.parametrize("at_s", [4.0, 30.0], ids=["searching", "driving"])
def test_the_detective_finds_its_target_in_the_same_time(at_s: float) -> None:
    moment, long = mission_time_s(2.0, at_s), mission_time_s(60.0, at_s)
    assert long == pytest.approx(moment, rel=SAME)
