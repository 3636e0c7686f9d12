"""The detective's own models: angles, mission, the turn check, the second look."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from firmware_boards.detective.angles import are_close, growth, is_between, shorter_way_grows
from firmware_boards.detective.messages import Degree, Message
from firmware_boards.detective.mission import Mission
from firmware_boards.detective.second_look import SecondLook
from firmware_boards.detective.sensors import Compass2
from firmware_boards.detective.turning import HeadTurn, StraightCourse, Turn, VehicleTurn
from firmware_drivers.motors import CLOCKWISE, COUNTERCLOCKWISE, STILL
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.board import installed as kinds
from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.models.motion import Applied
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.faults import AbsentTarget, FaultScript
from sim_doubles.worlds.arena import Arena
from tests.support.atomic_bench import AtomicBench
from tests.support.lookalikes import RegisterRam
from tests.support.virtual_detective import VirtualDetective, virtual_detective

DEGREES = st.decimals(-1000, 1000, places=3).map(float)


@settings(deadline=None)
@given(DEGREES, DEGREES)
def test_growth_leads_from_start_to_end(start: float, end: float) -> None:
    grown = growth(start, end)
    assert 0 <= grown < 360
    assert are_close(start + grown, end, 0)


@settings(deadline=None)
@given(DEGREES, DEGREES)
def test_the_way_taken_is_no_longer_than_half_a_turn(heading: float, target: float) -> None:
    grown = growth(heading, target)
    assert (grown if shorter_way_grows(heading, target) else (360 - grown) % 360) <= 180


@settings(deadline=None)
@given(DEGREES, st.integers(-3, 3))
def test_whole_turns_make_no_difference_to_a_match(angle: float, turns: int) -> None:
    assert are_close(angle, angle + 360 * turns, 0)
    assert not are_close(angle, angle + 360 * turns + 0.001, 0)


@pytest.mark.parametrize(
    ("start", "angle", "end", "is_so"),
    [
        (294, 292, 289, True),
        (289, 292, 294, True),
        (2, 359, 355, True),
        (355, 359, 2, True),
        (294, 292, 293, False),
        (289, 292, 291, False),
        (100, 292, 120, False),
        (200, 20, 190, False),
        (250, 292, 340, False),
    ],
)
def test_an_angle_lies_between_two_that_are_near_it(
    start: float, angle: float, end: float, *, is_so: bool
) -> None:
    assert is_between(start, angle, end) == is_so


@pytest.mark.parametrize(
    ("readings", "tolerance_deg", "matches"),
    [
        ([294, 293, 289], 0.5, 1),
        ([294, 293], 0.5, 0),
        ([294, 292], 0.5, 1),
        ([280, 285, 300], 0.5, 1),
        ([294, 293, 289], 0.0, 0),
        ([294, 292], 0.0, 1),
    ],
)
def test_a_heading_matches_that_leaps_over_what_it_was_asked_for(
    readings: list[float], tolerance_deg: float, matches: int
) -> None:
    compass = AtomicBench(Compass2("compass2", tolerance_deg=tolerance_deg))
    compass.put(5, request=Degree(292))
    compass.put(10, reading=292.0)
    assert len(compass.said["answer"]) == 0
    compass.run(50)
    assert len(compass.said["answer"]) == 1
    compass.put(100, request=Degree(292))  # what was read before counts no more
    for index, reading in enumerate(readings):
        compass.put(110 + 20 * index, reading=float(reading))
    compass.run(1000)
    assert len(compass.said["answer"]) == 1 + matches


def test_kinds_of_message_never_compare_equal() -> None:
    assert Degree(1) == Degree(1.0)
    assert Message(1) == Message(1.0)
    assert Degree(1) != Message(1)


@pytest.mark.parametrize("tolerance", [-1.0, float("nan")])
def test_a_tolerance_that_nothing_could_meet_is_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match="expected zero or more"):
        Compass2("compass2", tolerance_deg=tolerance)


LONGEST = 20 * SECOND


class Watched:
    """A mission alone, with an interlock that can be taken back.

    `begun_s` is when it was given its start signal, `endings` how it ended, and when.
    """

    def __init__(self) -> None:
        self.may_move = True
        self.begun_s: list[float] = []
        self.endings: list[tuple[float, Ending]] = []
        self.mission = mission = Mission("mission", SECOND, 5, LONGEST, lambda: self.may_move)
        self.simulator = Simulator(mission)
        self.treads = {"right": mission.right, "left": mission.left}
        self.simulator.listen(mission.in1, lambda at, _: self.begun_s.append(at / SECOND))
        self.simulator.listen(
            mission.ended, lambda at, ending: self.endings.append((at / SECOND, ending))
        )

    def run(self, until_s: int) -> None:
        self.simulator.run(until_s * SECOND)

    def command(self, *commands: tuple[str, int]) -> None:
        """Commands to the treads, one by one, as a link delivers them."""
        for tread, signal in commands:
            self.simulator.inject(self.treads[tread], signal)
            self.simulator.run(self.simulator.now)


def test_a_mission_that_takes_too_long_has_failed_once_and_disarmed_time_does_not_count() -> None:
    watched = Watched()
    watched.run(20)
    assert watched.endings == []
    watched.run(100)
    ((at_s, ending),) = watched.endings
    assert at_s == 21
    assert ending.failed
    assert "20 s" in ending.reason
    watched = Watched()
    watched.may_move = False
    watched.run(1000)
    watched.may_move = True
    watched.run(1019)
    assert watched.endings == []
    watched.run(1030)
    assert len(watched.endings) == 1


FAILS, WORKS = (Fault("NoAcknowledge", "sonar1: no answer", times) for times in (2, 1))


@pytest.mark.parametrize(
    ("faults", "starts_at_s"),
    [
        ({}, 1.0),
        ({0.9: WORKS}, 1.0),
        ({0.2: FAILS}, 1.2),
        ({0.2: FAILS, 1.1: FAILS, 1.3: FAILS, 1.5: WORKS}, 1.6),
    ],
)
def test_a_mission_begins_once_no_device_fails_again_and_again(
    faults: dict[float, Fault], starts_at_s: float
) -> None:
    watched = Watched()
    for at_s, fault in faults.items():
        watched.simulator.run(round(at_s * SECOND))
        watched.simulator.inject(watched.mission.fault, fault)
        watched.simulator.run(watched.simulator.now)
    watched.run(5)
    assert watched.begun_s == [starts_at_s]


FORWARD = (("right", 1), ("left", 1))
STOP = (("right", 0), ("left", 0))
TURN = (("right", 2), ("left", 1))
ON = (("right", 1),)


@pytest.mark.parametrize(
    "first_stop", [STOP, STOP[::-1], STOP[:1], STOP[1:], ()], ids=lambda stop: f"arrived {stop}"
)
def test_the_target_is_reached_whatever_a_link_delivered_of_the_stop_before_the_turn(
    first_stop: tuple[tuple[str, int], ...],
) -> None:
    watched = Watched()
    watched.run(2)
    watched.command(*FORWARD, *first_stop, *TURN, *ON)
    watched.run(3)
    assert watched.endings == []
    watched.command(*STOP)
    watched.run(4)
    ((_, ending),) = watched.endings
    assert not ending.failed


def test_a_robot_that_only_stopped_has_not_reached_its_target() -> None:
    watched = Watched()
    watched.run(2)
    watched.command(*FORWARD, *STOP)
    watched.run(10)
    assert watched.endings == []


@pytest.fixture
def bench() -> AtomicBench:
    return AtomicBench(VehicleTurn("commanded_turn", 20.0))


def turned(bench: AtomicBench, begin_ms: int, headings: Sequence[int]) -> list[Turn]:
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
        (CLOCKWISE, CLOCKWISE, Applied.NOTHING),
    ],
)
def test_nothing_is_said_of_what_does_not_turn(
    bench: AtomicBench, right: int, left: int, applied: Applied
) -> None:
    bench.put(10, right=right, left=left, applied=applied)
    assert turned(bench, 20, range(5)) == []


@pytest.mark.parametrize("from_start", [True, False])
def test_a_course_is_watched_from_the_start_or_once_it_has_turned(*, from_start: bool) -> None:
    bench = AtomicBench(StraightCourse("course", from_start=from_start))
    bench.put(5, right=CLOCKWISE)  # over a link, the other one comes later
    bench.put(10, left=CLOCKWISE, applied=Applied.ALL)
    said = turned(bench, 20, [358, 1, 4])
    assert said == ([(0.0, 0), (0.0, 3), (0.0, 6)] if from_start else [])
    bench.put(85, left=COUNTERCLOCKWISE)
    assert turned(bench, 100, [6, 40]) == ([(0.0, 8)] if from_start else [])
    bench.put(145, left=CLOCKWISE)
    assert turned(bench, 160, [90, 91, 88]) == [(0.0, 0), (0.0, 1), (0.0, -2)]


def test_a_head_that_stands_may_do_so_at_an_end_stop_until_it_turns_back() -> None:
    head = AtomicBench(HeadTurn("commanded_head", 250.0))
    head.put(10, motor=CLOCKWISE, applied=Applied.ALL, body=0)
    assert turned(head, 20, [0, 0, 0]) == []
    assert turned(head, 80, [357, 354, 354, 354]) == [(0.0, 357), (-250.0, 354), (0.0, 354)]
    head.put(165, motor=COUNTERCLOCKWISE)
    assert turned(head, 180, [354, 354]) == [(0.0, 354), (250.0, 354)]
    head.put(225, motor=STILL)
    assert turned(head, 240, [358, 0]) == [(0.0, 358)]
    head.put(285, motor=COUNTERCLOCKWISE)
    assert turned(head, 300, [0, 0, 0]) == []
    head.put(365, motor=CLOCKWISE)
    assert turned(head, 380, [0, 0]) == [(0.0, 0), (-250.0, 0)]


@pytest.mark.parametrize(
    ("body_deg", "motor", "share"),
    [
        (1, CLOCKWISE, -250.0),
        (1, COUNTERCLOCKWISE, 250.0),
        (350, CLOCKWISE, 0.0),
        (350, COUNTERCLOCKWISE, 250.0),
        (330, COUNTERCLOCKWISE, 0.0),
        (330, CLOCKWISE, -250.0),
    ],
)
def test_a_head_may_stand_near_the_stop_only_that_it_turns_towards(
    body_deg: int, motor: int, share: float
) -> None:
    head = AtomicBench(HeadTurn("commanded_head", 250.0, stop_deg=190.0))
    head.put(10, motor=motor, applied=Applied.ALL, body=body_deg)
    found = turned(head, 20, [160, 160, 160])
    assert [each.rate_deg_s for each in found] == ([0.0, share, share] if share else [])


def test_a_head_that_has_turned_back_stands_at_a_stop_for_a_stated_time() -> None:
    head = AtomicBench(HeadTurn("commanded_head", 250.0, stop_deg=190.0, at_stop=60 * MILLISECOND))
    head.put(10, motor=COUNTERCLOCKWISE, applied=Applied.ALL, body=0)
    head.put(20, motor=CLOCKWISE)
    found = turned(head, 30, [180, 174, 170, 170, 170, 170, 170, 170])
    assert [each.rate_deg_s for each in found] == [0.0, -250.0, 0.0, 0.0, -250.0]


def test_a_head_that_is_looked_at_often_does_not_stand_for_turning_little_meanwhile() -> None:
    head = AtomicBench(HeadTurn("commanded_head", 50.0, stop_deg=190.0))
    head.put(10, motor=COUNTERCLOCKWISE, applied=Applied.ALL, body=1)
    found = turned(head, 20, [182, 183, 184, 185, 186, 187, 188, 189])
    assert [each.rate_deg_s for each in found] == [0.0, 50.0, 50.0, 50.0, 50.0]


def test_a_head_whose_motor_failed_amid_its_turn_stands_at_no_stop_because_it_was_slow() -> None:
    head = AtomicBench(HeadTurn("commanded_head", 250.0, stop_deg=190.0, at_stop=SECOND))
    head.put(10, motor=CLOCKWISE, applied=Applied.ALL, body=0)
    head.put(12, motor=COUNTERCLOCKWISE)
    assert turned(head, 20, [173, 179]) == [(0.0, 173), (250.0, 179)]
    head.put(55, applied=Applied.NOTHING)
    assert turned(head, 60, [184]) == [(0.0, 184)]
    head.put(75, applied=Applied.ALL)
    assert turned(head, 80, [186, 191]) == [(0.0, 186), (250.0, 191)]


def test_a_head_is_followed_from_the_body_that_carries_it_and_not_before_that_is_known() -> None:
    head = AtomicBench(HeadTurn("commanded_head", 250.0))
    head.put(10, motor=COUNTERCLOCKWISE, applied=Applied.ALL)
    assert turned(head, 20, [100, 110]) == []
    head.put(65, body=350)
    assert turned(head, 70, [120, 130]) == [(0.0, 140)]
    head.put(115, body=30)
    assert turned(head, 120, [180, 190]) == [(250.0, 150), (250.0, 160)]


HEARD, NOTHING = ({"distance": 2.1}, {"distance": math.inf})


@pytest.mark.parametrize(
    ("command", "pings", "doubts"),
    [
        (CLOCKWISE, [NOTHING], []),
        (CLOCKWISE, [NOTHING, NOTHING], [2.0]),
        (CLOCKWISE, [NOTHING, NOTHING, NOTHING, NOTHING], [2.0]),
        (CLOCKWISE, [HEARD, NOTHING, NOTHING], []),
        (CLOCKWISE, [NOTHING, HEARD, NOTHING, NOTHING], []),
        (CLOCKWISE, [NOTHING, {"distance": 2.0, "detected": 1}, NOTHING, HEARD], []),
        (CLOCKWISE, [NOTHING, NOTHING, {"distance": 2.2, "detected": 1}, NOTHING, HEARD], [2.0]),
        (CLOCKWISE, [{"distance": 2.2, "detected": 1}, NOTHING, NOTHING], [2.2]),
        (STILL, [NOTHING, NOTHING], []),
        (None, [NOTHING, NOTHING], []),
    ],
)
def test_what_stops_a_head_has_to_be_heard_once_more(
    command: int | None, pings: list[dict[str, float]], doubts: list[float]
) -> None:
    look = AtomicBench(SecondLook("second_look"))
    if command is not None:
        look.put(10, head=command)
    look.put(20, distance=2.0, detected=1)
    for place, ping in enumerate(pings):
        look.put(86 + 66 * place, **ping)
    look.run(1000)
    assert [fault.value for fault in look.faults] == doubts


def test_a_head_stops_after_the_ping_of_that_instant_and_is_doubted_however_late_the_next() -> None:
    look = AtomicBench(SecondLook("second_look"))
    look.put(10, head=COUNTERCLOCKWISE)
    look.put(20, head=STILL, distance=2.0, detected=1)
    look.put(30, head=STILL)
    look.put(350, distance=math.inf)
    look.put(420, distance=math.inf)
    look.put(480, distance=2.0, detected=1)
    look.put(550, distance=math.inf)
    look.put(620, distance=math.inf)
    look.run(1000)
    (fault,) = look.said["fault"]
    assert (fault[0], fault[1].kind, fault[1].consecutive) == (420, "Implausible", 1)


# The robot ----------------------------------------------------------------------------------------


def contradicted(robot: VirtualDetective, begins_s: float, ends_s: float) -> float:
    """The difference in degrees for which the mission ended, within the time stated."""
    robot.run_mission()
    ((at, ending),) = robot.endings
    assert ending.failed
    assert begins_s * SECOND < at < ends_s * SECOND
    axis = "turn (degrees, compass less treads' command)"  # a wheel's own check may come first
    (fault,) = [each for _, each in robot.faults if each.axis == axis]
    assert fault.reason == ending.reason
    robot.run(robot.simulator.now / SECOND + 0.5)
    assert robot.are_treads_still()
    return fault.value


def test_states_of_both_controllers_go_into_the_log_of_the_arena() -> None:
    robot = virtual_detective()
    robot.run(0.6)
    states = {
        model: [stay.state for stay in stays]
        for model, stays in robot.rig.log.stays(robot.simulator.now).items()
    }
    assert states["radarController"][-1] == "Ask motor1 to turn right"
    assert states.keys() == {"radarController", "movementController"}


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
    robot = virtual_detective("world.compass_mounting=upright")
    robot.run_mission()
    ((at, ending),) = robot.endings
    assert 0.6 < at / SECOND < 1.2  # the head's turns first
    assert "turn of the head" in ending.reason


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
    robot.run_mission()
    ((at, ending),) = robot.endings
    assert ending.failed
    assert 5.0 < at / SECOND < 8.5
    assert "left wheel's turn is 0, expected" in ending.reason  # five times in a row


@pytest.mark.slow
@pytest.mark.parametrize("slip", [0.0, 0.3, 0.6])
def test_treads_that_slip_are_not_contradicted(slip: float) -> None:
    robot = virtual_detective(f"world.right_slip={slip}", f"world.left_slip={slip}")
    assert robot.run_mission()["found"] is True
    assert robot.faults == []


@pytest.mark.slow
@pytest.mark.parametrize("speed_deg_s", [50.0, 60.0])
def test_a_head_on_a_battery_that_is_low_or_full_is_not_contradicted(speed_deg_s: float) -> None:
    far = "world.target=[6.0, 6.0]"
    robot = virtual_detective(f"world.head_speed_deg_s={speed_deg_s}", far)
    robot.run(60)
    assert robot.faults == []


@pytest.mark.slow
def test_without_the_tables_nothing_is_compared(tmp_path: Path) -> None:
    text = kinds.shipped_file("detective").read_text()
    for each in ("[turn_check]", "[head_check]"):
        begin, table, end = text.partition(each)
        assert table
        text = begin + "[" + end.partition("\n[")[2]
    board = tmp_path / "board.toml"
    board.write_text(text)
    robot = virtual_detective("world.wheel_radius_m=0.00001", board=board)
    robot.run(20)
    assert robot.endings == []
