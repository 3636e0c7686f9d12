"""The body's compass against the treads' commands: what is contradicted, and what never is."""

from collections.abc import Callable
from pathlib import Path

import pytest
from firmware_boards.detective.turning import CommandedTurn, Turn
from firmware_drivers.motors import CLOCKWISE, COUNTERCLOCKWISE, STILL

from firmware_runtime.board import installed as kinds
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.motion import Applied
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.faults import AbsentTarget, FaultScript
from sim_doubles.worlds.arena import Arena
from tests.support.atomic_bench import AtomicBench
from tests.support.lookalikes import RegisterRam
from tests.support.virtual_detective import VirtualDetective, virtual_detective


@pytest.fixture
def bench() -> AtomicBench:
    return AtomicBench(CommandedTurn("commanded_turn", 20.0))


def turned(bench: AtomicBench, begin_ms: int, headings: range) -> list[Turn]:
    """What is said of headings, one every 20 ms."""
    before = len(bench.values("turn"))
    for place, heading in enumerate(headings):
        bench.put(begin_ms + 20 * place, heading=heading)
    bench.run(begin_ms + 20 * len(headings))
    return bench.values("turn")[before:]


# The command --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("right", "left", "rate_deg_s"),
    [
        (CLOCKWISE, COUNTERCLOCKWISE, 20.0),
        (COUNTERCLOCKWISE, CLOCKWISE, -20.0),
        (CLOCKWISE, STILL, 10.0),
    ],
)
def test_a_turn_begins_and_ends_with_a_rate_of_zero(
    bench: AtomicBench, right: int, left: int, rate_deg_s: float
) -> None:
    bench.put(10, right=right, left=left, applied=Applied.ALL)
    assert turned(bench, 20, range(3)) == [(0.0, 0), (rate_deg_s, 1), (rate_deg_s, 2)]
    bench.put(85, right=STILL, left=STILL)
    assert turned(bench, 100, range(3, 6)) == [(0.0, 3)]


@pytest.mark.parametrize(
    ("right", "left", "applied"),
    [
        (CLOCKWISE, CLOCKWISE, Applied.ALL),
        (STILL, STILL, Applied.ALL),
        (7, 7, Applied.ALL),
        (CLOCKWISE, COUNTERCLOCKWISE, Applied.NOTHING),
    ],
)
def test_nothing_is_said_of_what_does_not_turn(
    bench: AtomicBench, right: int, left: int, applied: Applied
) -> None:
    bench.put(10, right=right, left=left, applied=applied)
    assert turned(bench, 20, range(5)) == []


# The robot ----------------------------------------------------------------------------------------


def contradicted(robot: VirtualDetective, begins_s: float, ends_s: float) -> float:
    """The difference in degrees for which the mission ended, within the time stated."""
    robot.run_mission()
    ((at, ending),) = robot.endings
    assert ending.failed
    assert begins_s * SECOND < at < ends_s * SECOND
    (fault,) = [each for _, each in robot.faults if each.kind == "Implausible"]
    assert fault.axis == "turn (degrees, compass less treads' command)"
    assert fault.reason == ending.reason
    robot.run(robot.simulator.now / SECOND + 0.5)
    assert robot.are_treads_still()
    return fault.value


def frozen_bearing(_arena: Arena, _at: int) -> float:
    """Of a compass whose raw field goes on with its noise."""
    return 100.0


def mirrored_bearing(arena: Arena, at: int) -> float:
    return -TRUE_BEARING(arena, at) % 360.0


TRUE_BEARING = Arena.body_bearing_deg


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bearing_deg", "most_s"), [(frozen_bearing, 3.0), (mirrored_bearing, 0.6)]
)
def test_a_lively_compass_that_reads_no_turn_or_the_other_way_ends_the_mission(
    monkeypatch: pytest.MonkeyPatch, bearing_deg: Callable[[Arena, int], float], most_s: float
) -> None:
    monkeypatch.setattr(Arena, "body_bearing_deg", bearing_deg)
    turns_from_s = 5.0
    value = contradicted(virtual_detective(), turns_from_s, turns_from_s + most_s + 0.3)
    assert 10 < abs(value) < 60


@pytest.mark.slow
def test_compasses_mounted_the_other_way_up_are_found_at_the_first_turn() -> None:
    contradicted(virtual_detective("world.compass_mounting=upright"), 5.0, 6.0)


@pytest.mark.slow
def test_treads_that_do_nothing_end_the_mission() -> None:
    contradicted(virtual_detective("world.wheel_radius_m=0.00001"), 5.0, 8.5)


@pytest.mark.slow
def test_a_memory_in_place_of_the_motor_driver_ends_the_mission() -> None:
    robot = virtual_detective()
    bus = robot.rig.buses["i2c1"]
    (driver,) = (each for each in bus.targets if isinstance(each, Md25Double))
    bus.faults = FaultScript([AbsentTarget(target=driver)])
    bus.connect(RegisterRam(driver._now, driver.address, {13: 1, 14: 5}))
    contradicted(robot, 5.0, 8.5)


@pytest.mark.slow
@pytest.mark.parametrize("slip", [0.0, 0.3, 0.6])
def test_treads_that_slip_are_not_contradicted(slip: float) -> None:
    robot = virtual_detective(f"world.right_slip={slip}", f"world.left_slip={slip}")
    assert robot.run_mission()["found"] is True
    assert robot.faults == []


@pytest.mark.slow
def test_without_the_table_nothing_is_compared(tmp_path: Path) -> None:
    begin, table, end = kinds.shipped_file("detective").read_text().partition("[turn_check]")
    board = tmp_path / "board.toml"
    board.write_text(begin + "[" + end.partition("\n[")[2])
    assert table
    robot = virtual_detective("world.wheel_radius_m=0.00001", board=board)
    robot.run(20)
    assert robot.endings == []
