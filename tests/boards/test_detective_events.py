"""The issue's rules for the detective robot, each as an event file and what must come of it."""

from itertools import pairwise

import pytest
from firmware_boards.detective.detective import Detective
from firmware_boards.detective.parameters import Parameters
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.ecdpp.event_file import Event, parse_events
from firmware_runtime.ecdpp.experiment import run_events

RIGHT, LEFT = ["out2 1", "out3 2"], ["out2 2", "out3 1"]


def run(
    events: str, until_ms: int | None = None, parameters: Parameters | None = None
) -> list[str]:
    model = Detective(parameters=parameters)
    until = None if until_ms is None else until_ms * MILLISECOND
    played = parse_events(events, "test", model)
    return [str(line) for line in run_events(model, played, until, checked=True)]


def mission(target: str, *headings: str, parameters: Parameters | None = None) -> list[str]:
    """A mission to a target with these headings at 4.0, 4.1 ... s: its lines after the radar's."""
    events = [f"00:00:01:000 In1 1\n00:00:02:000 In2 1\n00:00:03:000 In3 {target}"]
    events += [f"00:00:04:{n}00 In4 {heading}" for n, heading in enumerate(headings)]
    lines = run("\n".join(events), parameters=parameters)
    assert lines[:6] == [
        "00:00:01:020 out2 1",
        "00:00:01:020 out3 1",
        "00:00:01:030 out1 1",
        "00:00:02:030 out1 0",
        "00:00:02:040 out2 0",
        "00:00:02:040 out3 0",
    ]
    return lines[6:]


def turn(target: str, heading: str) -> list[str]:
    """Which way the vehicle turns: the lines without their times, which are checked here."""
    lines = mission(target, heading)
    assert [line[:12] for line in lines] == ["00:00:04:030"] * 2
    return [line[13:] for line in lines]


# Starting ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", ["0", "2", "-1", "1.5"])
def test_only_the_value_1_starts(value: str) -> None:
    assert run(f"00:00:01:000 In1 {value}") == []


def test_one_written_as_a_decimal_starts_too() -> None:
    assert len(run("00:00:01:000 In1 1.0", until_ms=1100)) == 3


def test_starting_again_while_driving_has_no_effect() -> None:
    starts = [f"00:00:0{second}:500 In1 1" for second in range(1, 6)]
    assert run("\n".join(starts), until_ms=8000) == [
        "00:00:01:520 out2 1",
        "00:00:01:520 out3 1",
        "00:00:01:530 out1 1",
        "00:00:04:530 out1 2",
        "00:00:07:530 out1 1",
    ]


def test_starting_again_while_the_start_is_under_way_does_not_delay_it() -> None:
    events = "00:00:01:000 In1 1\n00:00:01:005 In1 1\n00:00:01:010 In1 1"
    assert run(events, until_ms=1100) == [
        "00:00:01:020 out2 1",
        "00:00:01:020 out3 1",
        "00:00:01:030 out1 1",
    ]


def test_a_start_at_the_instant_zero_is_played() -> None:
    assert run("00:00:00:00 In1 1", until_ms=100) == [
        "00:00:00:020 out2 1",
        "00:00:00:020 out3 1",
        "00:00:00:030 out1 1",
    ]


# The radar --------------------------------------------------------------------------------------


def test_the_radar_reverses_every_half_sweep_from_the_instant_of_its_turn_command() -> None:
    lines = run("00:00:01:000 In1 1", until_ms=13_100)
    assert lines[2:] == [
        "00:00:01:030 out1 1",
        "00:00:04:030 out1 2",
        "00:00:07:030 out1 1",
        "00:00:10:030 out1 2",
        "00:00:13:030 out1 1",
    ]


def test_the_half_sweep_is_a_parameter() -> None:
    lines = run("00:00:01:000 In1 1", 3000, Parameters(half_sweep=SECOND // 2))
    assert lines[2:] == [
        "00:00:01:030 out1 1",
        "00:00:01:530 out1 2",
        "00:00:02:030 out1 1",
        "00:00:02:530 out1 2",
    ]


def test_inputs_without_effect_do_not_delay_the_reversal() -> None:
    noise = [f"00:00:0{second}:7{tenth}0 In2 2" for second in range(1, 4) for tenth in range(10)]
    lines = run("\n".join(["00:00:01:000 In1 1", *noise]), until_ms=5000)
    assert lines[2:] == ["00:00:01:030 out1 1", "00:00:04:030 out1 2"]


def test_an_object_is_detected_while_the_radar_turns_left() -> None:
    lines = run("00:00:01:000 In1 1\n00:00:05:000 In2 1", until_ms=20_000)
    assert lines[3:] == [
        "00:00:04:030 out1 2",
        "00:00:05:030 out1 0",
        "00:00:05:040 out2 0",
        "00:00:05:040 out3 0",
    ]


@pytest.mark.parametrize("value", ["0", "2", "-1", "0.5"])
def test_only_the_value_1_is_a_detection(value: str) -> None:
    lines = run(f"00:00:01:000 In1 1\n00:00:02:000 In2 {value}", until_ms=3000)
    assert lines[3:] == []


def test_a_detection_before_the_start_has_no_effect() -> None:
    lines = run("00:00:00:500 In2 1\n00:00:01:000 In1 1", until_ms=3000)
    assert lines[3:] == []


def test_a_detection_counts_from_the_instant_of_the_radar_s_turn_command() -> None:
    early = run("00:00:01:000 In1 1\n00:00:01:009 In2 1", until_ms=3000)
    assert early[3:] == []
    in_time = run("00:00:01:000 In1 1\n00:00:01:010 In2 1", until_ms=3000)
    assert in_time[2:] == [
        "00:00:01:030 out1 1",
        "00:00:01:040 out1 0",
        "00:00:01:050 out2 0",
        "00:00:01:050 out3 0",
    ]


def test_a_detection_at_the_instant_of_the_reversal_stops_the_radar_after_it() -> None:
    lines = run("00:00:01:000 In1 1\n00:00:04:010 In2 1", until_ms=20_000)
    assert lines[3:] == [
        "00:00:04:030 out1 2",
        "00:00:04:040 out1 0",
        "00:00:04:050 out2 0",
        "00:00:04:050 out3 0",
    ]


def test_a_detection_just_before_the_reversal_prevents_it() -> None:
    lines = run("00:00:01:000 In1 1\n00:00:04:009 In2 1", until_ms=20_000)
    assert lines[3:] == [
        "00:00:04:039 out1 0",
        "00:00:04:049 out2 0",
        "00:00:04:049 out3 0",
    ]


def test_the_target_angle_is_dropped_until_it_is_requested() -> None:
    events = "00:00:01:000 In1 1\n00:00:02:000 In2 1\n00:00:02:{} In3 90\n00:00:04:000 In4 10"
    assert len(run(events.format("019"))) == 6
    assert len(run(events.format("020"))) == 8


# Turning ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("target", "heading", "way"),
    [
        ("200", "50", RIGHT),
        ("50", "200", LEFT),
        ("10", "350", RIGHT),
        ("350", "10", LEFT),
        ("179", "0", RIGHT),
        ("181", "0", LEFT),
        ("180", "0", LEFT),
        ("0", "180", RIGHT),
        ("90", "270", RIGHT),
        ("270", "90", LEFT),
        ("45", "45", LEFT),
        ("0", "360", LEFT),
        ("1", "0", RIGHT),
        ("0", "1", LEFT),
        ("380", "10", RIGHT),
        ("10", "740", LEFT),
        ("-90", "260", RIGHT),
        ("90.5", "90.4", RIGHT),
    ],
)
def test_the_vehicle_turns_the_shorter_way(target: str, heading: str, way: list[str]) -> None:
    assert turn(target, heading) == way


def test_after_a_right_turn_only_the_left_tread_is_commanded() -> None:
    assert mission("200", "50", "199", "200")[2:] == ["00:00:04:230 out3 1"]


def test_after_a_left_turn_only_the_right_tread_is_commanded() -> None:
    assert mission("50", "200", "51", "50")[2:] == ["00:00:04:230 out2 1"]


def test_a_heading_equal_to_the_target_still_turns_until_it_is_read_again() -> None:
    assert mission("45", "45")[2:] == []
    assert mission("45", "45", "45")[2:] == ["00:00:04:130 out2 1"]


@pytest.mark.parametrize("heading", ["0", "1", "359"])
def test_a_target_of_1_degree_is_no_request_for_the_heading(heading: str) -> None:
    way = LEFT if heading == "1" else RIGHT
    forward = "out3 1" if way is RIGHT else "out2 1"
    lines = mission("1", heading, "2", "0", "1")
    assert [line[13:] for line in lines] == [*way, forward]
    assert lines[2][:12] == "00:00:04:330"


@pytest.mark.parametrize(
    ("target", "reading"),
    [("10", "370"), ("10", "-350"), ("370", "10"), ("0", "360"), ("200.1", "560.1")],
)
def test_a_match_is_equality_modulo_360(target: str, reading: str) -> None:
    assert len(mission(target, "100", reading)) == 3


@pytest.mark.parametrize("reading", ["200.001", "199.999", "20", "0"])
def test_next_to_the_target_is_no_match(reading: str) -> None:
    assert len(mission("200", "100", reading)) == 2


@pytest.mark.parametrize("reading", ["357", "357.5", "0", "2", "3", "362.9"])
def test_within_the_tolerance_is_a_match_across_north_too(reading: str) -> None:
    within = Parameters(tolerance_deg=3)
    assert len(mission("0", "100", reading, parameters=within)) == 3


@pytest.mark.parametrize("reading", ["356.9", "3.1", "180"])
def test_beyond_the_tolerance_is_no_match(reading: str) -> None:
    within = Parameters(tolerance_deg=3)
    assert len(mission("0", "100", reading, parameters=within)) == 2


def test_headings_are_dropped_until_they_are_requested() -> None:
    start = "00:00:01:000 In1 1\n00:00:02:000 In2 1\n00:00:03:000 In3 90\n"
    # The controller asks 30 ms after the target's angle came.
    assert len(run(start + "00:00:03:029 In4 10")) == 6
    assert run(start + "00:00:03:030 In4 10")[6:] == ["00:00:03:060 out2 1", "00:00:03:060 out3 2"]


def test_a_match_counts_from_the_instant_of_the_turn_command() -> None:
    start = "00:00:01:000 In1 1\n00:00:02:000 In2 1\n00:00:03:000 In3 90\n00:00:04:000 In4 10\n"
    assert len(run(start + "00:00:04:019 In4 90")) == 8
    assert run(start + "00:00:04:020 In4 90")[8:] == ["00:00:04:050 out3 1"]


def test_readings_that_crowd_are_each_compared() -> None:
    start = "00:00:01:000 In1 1\n00:00:02:000 In2 1\n00:00:03:000 In3 90\n00:00:04:000 In4 10\n"
    crowd = "".join(f"00:00:05:{ms:03d} In4 {88 + ms}\n" for ms in range(6))
    assert run(start + crowd)[8:] == ["00:00:05:032 out3 1"]


# Driving to the target --------------------------------------------------------------------------


def arrival(events: str) -> list[str]:
    """Lines after the vehicle has matched its heading at 5 s, drives on and gets these events."""
    start = (
        "00:00:01:000 In1 1\n00:00:02:000 In2 1\n00:00:03:000 In3 90\n"
        "00:00:04:000 In4 10\n00:00:05:000 In4 90\n"
    )
    lines = run(start + events)
    assert lines[8] == "00:00:05:030 out3 1"
    return lines[9:]


@pytest.mark.parametrize("value", ["1", "2", "-1", "0.1", "300"])
def test_any_value_but_zero_stops_at_the_target(value: str) -> None:
    stopped = ["00:00:06:030 out2 0", "00:00:06:030 out3 0"]
    assert arrival(f"00:00:06:000 In5 {value}") == stopped


def test_zero_does_not_stop_at_the_target() -> None:
    assert arrival("00:00:06:000 In5 0\n00:00:06:100 In5 0.0") == []


def test_the_body_sonar_counts_only_while_driving_to_the_target() -> None:
    events = (
        "00:00:00:500 In5 2\n00:00:01:000 In1 1\n00:00:01:500 In5 2\n00:00:02:000 In2 1\n"
        "00:00:02:500 In5 2\n00:00:03:000 In3 90\n00:00:03:500 In5 2\n00:00:04:000 In4 10\n"
        "00:00:04:500 In5 2\n00:00:05:000 In4 90\n00:00:05:{} In5 2\n"
    )
    assert len(run(events.format("019"))) == 9
    assert run(events.format("020"))[8:] == [
        "00:00:05:030 out3 1",
        "00:00:05:050 out2 0",
        "00:00:05:050 out3 0",
    ]


def test_a_second_object_while_driving_to_the_target_has_no_effect() -> None:
    assert arrival("00:00:06:000 In2 1\n00:00:06:500 In3 10\n00:00:07:000 In4 0") == []


def test_a_second_object_while_the_first_is_being_located_has_no_effect() -> None:
    events = (
        "00:00:01:000 In1 1\n00:00:02:000 In2 1\n00:00:02:500 In2 1\n00:00:03:000 In3 90\n"
        "00:00:03:010 In3 180\n00:00:03:500 In2 1\n00:00:04:000 In4 0\n00:00:05:000 In4 180\n"
        "00:00:06:000 In4 90\n"
    )
    assert run(events)[6:] == [
        "00:00:04:030 out2 1",
        "00:00:04:030 out3 2",
        "00:00:06:030 out3 1",
    ]


def test_a_start_after_the_final_stop_is_a_new_mission() -> None:
    first = (
        "00:00:01:000 In1 1\n00:00:02:000 In2 1\n00:00:03:000 In3 90\n00:00:04:000 In4 10\n"
        "00:00:05:000 In4 90\n00:00:06:000 In5 1\n00:00:06:{} In1 1\n"
    )
    second = (
        "00:00:12:000 In2 1\n00:00:13:000 In3 10\n00:00:14:000 In4 90\n00:00:15:000 In4 10\n"
        "00:00:16:000 In5 1\n"
    )
    assert run(first.format("019") + second)[11:] == []
    assert run(first.format("020") + second)[11:] == [
        "00:00:06:040 out2 1",
        "00:00:06:040 out3 1",
        "00:00:06:050 out1 1",
        "00:00:09:050 out1 2",
        "00:00:12:030 out1 0",
        "00:00:12:040 out2 0",
        "00:00:12:040 out3 0",
        "00:00:14:030 out2 2",
        "00:00:14:030 out3 1",
        "00:00:15:030 out2 1",
        "00:00:16:030 out2 0",
        "00:00:16:030 out3 0",
    ]


# Everything -------------------------------------------------------------------------------------


def test_every_hop_is_one_parameter() -> None:
    lines = run("00:00:01:000 In1 1", 2000, Parameters(hop=100 * MILLISECOND))
    assert lines == ["00:00:01:200 out2 1", "00:00:01:200 out3 1", "00:00:01:300 out1 1"]


def test_without_a_hop_everything_happens_at_once_and_in_order_of_port_name() -> None:
    lines = run("00:00:01:000 In1 1", 2000, Parameters(hop=0))
    assert lines == ["00:00:01:000 out1 1", "00:00:01:000 out2 1", "00:00:01:000 out3 1"]


EVENTS = st.builds(
    Event,
    st.integers(0, 4000).map(lambda fives: fives * 5 * MILLISECOND),
    st.sampled_from(["In1", "In2", "In3", "In4", "In5"]),
    st.sampled_from([1.0, 2.0, 90.0]),
)


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(st.lists(EVENTS, max_size=60))
def test_a_motor_never_puts_out_what_it_already_does(events: list[Event]) -> None:
    lines = run_events(Detective(), sorted(events), checked=True)
    for port in ("out1", "out2", "out3"):
        values = [0, *(line.value for line in lines if line.port == port)]
        assert all(before != after for before, after in pairwise(values))
