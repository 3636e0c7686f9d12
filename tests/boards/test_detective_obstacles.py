"""With `mission.avoid_obstacles` the detective drives past what its radar looks over."""

import pytest
from firmware_boards.detective.detective import ATOMIC_CLASSES, Detective
from firmware_boards.detective.parameters import Parameters

from firmware_runtime.devs.time import SECOND
from firmware_runtime.ecdpp.event_file import parse_events
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.model_file import parse_model
from firmware_runtime.ecdpp.model_writer import model_text
from tests.support import figure_6
from tests.support.ecdpp_round_trip import described
from tests.support.low_obstacles import mission
from tests.support.virtual_detective import virtual_detective

AVOIDING = Parameters(avoid_obstacles=True, aside=2 * SECOND)
TO_THE_TARGET = """\
00:00:02:000 In1 1
00:00:05:000 In2 1
00:00:06:000 In3 200
00:00:09:000 In4 50
00:00:11:050 In4 200
"""
"""As in Figure 6, until the vehicle drives to the target."""


def played(events: str, since: str) -> list[str]:
    model = Detective(parameters=AVOIDING)
    lines = run_events(model, parse_events(TO_THE_TARGET + events, "", model), checked=True)
    return [str(line) for line in lines if str(line) >= since]


def test_what_is_within_reach_and_ahead_is_the_target() -> None:
    events = "00:00:15:000 In5 2\n00:00:16:000 In2 2\n00:00:17:000 In3 210"
    assert played(events, "00:00:12") == [
        "00:00:15:030 out2 0",
        "00:00:15:030 out3 0",
        "00:00:15:040 out1 1",
        "00:00:16:030 out1 0",
        # Compass1, the Radar controller and the Movement controller, 10 ms each
        "00:00:17:030 out4 1",
    ]


def test_what_is_not_within_reach_stands_behind_an_obstacle_that_is_driven_past() -> None:
    events = (
        "00:00:15:000 In5 2\n00:00:16:000 In2 1\n00:00:17:000 In3 200\n"
        "00:00:18:000 In4 319\n00:00:19:000 In4 320\n"
    )
    assert played(events, "00:00:17") == [
        "00:00:17:040 out2 1",
        "00:00:17:040 out3 2",
        # 320 is 120 degrees left of the target: ahead for two seconds, and the radar looks again
        "00:00:19:030 out3 1",
        "00:00:21:030 out2 0",
        "00:00:21:030 out3 0",
        "00:00:21:040 out1 1",
        "00:00:24:040 out1 2",
        "00:00:27:040 out1 1",
    ]


def test_where_the_left_was_blocked_the_vehicle_turns_right_from_then_on() -> None:
    blocked = (
        "00:00:15:000 In5 2\n00:00:16:000 In2 1\n00:00:17:000 In3 200\n00:00:19:000 In4 320\n"
        "00:00:20:000 In5 2\n"
        "00:00:21:000 In2 1\n00:00:22:000 In3 200\n00:00:23:000 In4 320\n00:00:24:000 In4 200\n"
        "00:00:25:000 In5 2\n00:00:26:000 In2 1\n00:00:27:000 In3 200\n"
    )
    assert played(blocked, "00:00:27")[:2] == ["00:00:27:040 out2 2", "00:00:27:040 out3 1"]


def test_an_obstacle_before_the_first_detection_stops_the_vehicle_not_the_radar() -> None:
    model = Detective(parameters=AVOIDING)
    events = "00:00:02:000 In1 1\n00:00:03:000 In5 2\n00:00:04:000 In2 1\n00:00:04:500 In3 90"
    lines = [str(line) for line in run_events(model, parse_events(events, "", model))]
    assert lines[3:] == ["00:00:03:030 out2 0", "00:00:03:030 out3 0", "00:00:04:030 out1 0"]


def test_figure_6_begins_alike_and_ends_with_a_look_at_what_was_found() -> None:
    model = Detective(parameters=AVOIDING)
    lines = run_events(model, parse_events(figure_6.EVENTS, "", model))
    assert [str(line) for line in lines][:11] == figure_6.OUTPUTS.splitlines()
    assert str(lines[11]) == "00:00:15:040 out1 1"


def test_the_avoiding_model_goes_into_a_file_and_back() -> None:
    model = Detective(parameters=AVOIDING)
    read = parse_model(model_text(model, ATOMIC_CLASSES), "avoiding.ma", ATOMIC_CLASSES)
    assert described(read) == described(model)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_it_reaches_its_target_past_a_wall_and_touches_nothing(seed: int) -> None:
    ended = mission(seed)
    assert (ended["found"], ended["touched"]) == (True, False)


@pytest.mark.slow
def test_without_the_option_it_takes_the_wall_for_its_target() -> None:
    ended = mission(1, "mission.avoid_obstacles=false")
    assert (ended["found"], ended["touched"]) == (False, False)


@pytest.mark.slow
def test_without_an_obstacle_it_finds_its_target_as_ever() -> None:
    robot = virtual_detective("mission.avoid_obstacles=true")
    assert robot.run_mission()["found"] is True
