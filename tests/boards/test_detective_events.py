"""The rules of the detective robot, each as events and what must come of them.

Events are `1.5 In1 1`: at 1.5 s a 1 at port In1; outputs of an instant are `1.520 out2=1 out3=1`.
"""

from itertools import groupby, pairwise

import pytest
from firmware_boards.detective.detective import ATOMIC_CLASSES, Detective
from firmware_boards.detective.parameters import Parameters
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, SECOND, seconds
from firmware_runtime.ecdpp.event_file import Event, parse_events
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.model_file import parse_model
from firmware_runtime.ecdpp.model_writer import model_text
from tests.support import figure_6
from tests.support.ecdpp_round_trip import described
from tests.support.low_obstacles import mission as mission_past_a_wall
from tests.support.virtual_detective import virtual_detective
from tests.support.wire import sentences

RIGHT, LEFT = "out2=1 out3=2", "out2=2 out3=1"
STARTED = "1.020 out2=1 out3=1; 1.030 out1=1"
FOUND = f"{STARTED}; 2.030 out1=0; 2.040 out2=0 out3=0"
LOOKED = "1 In1 1; 2 In2 1; 3 In3 90"
TO_TARGET = f"{LOOKED}; 4 In4 10; 5 In4 90"
TURNING = f"{FOUND}; 4.030 {RIGHT}"
AHEAD = f"{TURNING}; 5.030 out3=1"


def event(text: str) -> Event:
    at_s, port, value = text.split()
    return Event(seconds(float(at_s)), port, float(value))


def played(events: str, until_s: float | None = None, parameters: Parameters | None = None) -> str:
    model = Detective(parameters=parameters)
    until = None if until_s is None else seconds(until_s)
    lines = run_events(model, sorted(map(event, events.split("; "))), until, checked=True)
    return "; ".join(
        " ".join([f"{at / SECOND:.3f}", *(f"{each.port}={each.value:g}" for each in same)])
        for at, same in groupby(lines, lambda line: line.at)
    )


STARTS = "; ".join(f"{second}.5 In1 1" for second in range(1, 6))
NOISE = "; ".join(f"{second}.7{tenth} In2 2" for second in range(1, 4) for tenth in range(10))
CROWD = "; ".join(f"5.00{ms} In4 {88 + ms}" for ms in range(6))
SECOND_MISSION = "12 In2 1; 13 In3 10; 14 In4 90; 15 In4 10; 16 In5 1"
LATE_SONAR = (
    "0.5 In5 2; 1 In1 1; 1.5 In5 2; 2 In2 1; 2.5 In5 2; 3 In3 90; 3.5 In5 2; 4 In4 10; 4.5 In5 2; "
    "5 In4 90"
)


@sentences(
    {
        **{f"{value} does not start": f"1 In1 {value} -> " for value in (0, 2, -1, 1.5)},
        "one written as a decimal starts too": f"1 In1 1.0; until 1.1 -> {STARTED}",
        "starting again while driving has no effect": (
            f"{STARTS}; until 8 -> 1.520 out2=1 out3=1; 1.530 out1=1; 4.530 out1=2; 7.530 out1=1"
        ),
        "starting again while the start is under way does not delay it": (
            f"1 In1 1; 1.005 In1 1; 1.010 In1 1; until 1.1 -> {STARTED}"
        ),
        "a start at the instant zero": "0 In1 1; until 0.1 -> 0.020 out2=1 out3=1; 0.030 out1=1",
        # the radar
        "the radar reverses every half sweep from the instant of its turn command": (
            f"1 In1 1; until 13.1 -> {STARTED}; 4.030 out1=2; 7.030 out1=1; 10.030 out1=2; 13.030 "
            "out1=1"
        ),
        "inputs without effect do not delay the reversal": (
            f"1 In1 1; {NOISE}; until 5 -> {STARTED}; 4.030 out1=2"
        ),
        "an object is detected while the radar turns left": (
            f"1 In1 1; 5 In2 1; until 20 -> {STARTED}; 4.030 out1=2; 5.030 out1=0; 5.040 out2=0 "
            "out3=0"
        ),
        **{
            f"{value} is no detection": f"1 In1 1; 2 In2 {value}; until 3 -> {STARTED}"
            for value in (0, 2, -1, 0.5)
        },
        "a detection before the start has no effect": f"0.5 In2 1; 1 In1 1; until 3 -> {STARTED}",
        "nor has one before the radar's turn command": (
            f"1 In1 1; 1.009 In2 1; until 3 -> {STARTED}"
        ),
        "one at the instant of the turn command counts": (
            f"1 In1 1; 1.010 In2 1; until 3 -> {STARTED}; 1.040 out1=0; 1.050 out2=0 out3=0"
        ),
        "one at the instant of the reversal stops the radar after it": (
            f"1 In1 1; 4.010 In2 1; until 20 -> {STARTED}; 4.030 out1=2; 4.040 out1=0; 4.050 "
            "out2=0 out3=0"
        ),
        "one just before the reversal prevents it": (
            f"1 In1 1; 4.009 In2 1; until 20 -> {STARTED}; 4.039 out1=0; 4.049 out2=0 out3=0"
        ),
        # what is dropped until it is asked for: target, heading, match
        "a target too early": f"1 In1 1; 2 In2 1; 2.019 In3 90; 4 In4 10 -> {FOUND}",
        "a target in time": f"1 In1 1; 2 In2 1; 2.020 In3 90; 4 In4 10 -> {TURNING}",
        # the controller asks 30 ms after the target's angle came
        "a heading too early": f"{LOOKED}; 3.029 In4 10 -> {FOUND}",
        "a heading in time": f"{LOOKED}; 3.030 In4 10 -> {FOUND}; 3.060 {RIGHT}",
        "a match too early": f"{LOOKED}; 4 In4 10; 4.019 In4 90 -> {TURNING}",
        "a match in time": f"{LOOKED}; 4 In4 10; 4.020 In4 90 -> {TURNING}; 4.050 out3=1",
        "readings that crowd are each compared": (
            f"{LOOKED}; 4 In4 10; {CROWD} -> {TURNING}; 5.032 out3=1"
        ),
        # driving to the target
        **{
            f"{value} stops at the target": (
                f"{TO_TARGET}; 6 In5 {value} -> {AHEAD}; 6.030 out2=0 out3=0"
            )
            for value in (1, 2, -1, 0.1, 300)
        },
        "zero does not": f"{TO_TARGET}; 6 In5 0; 6.1 In5 0.0 -> {AHEAD}",
        "the body's sonar does not count before": f"{LATE_SONAR}; 5.019 In5 2 -> {AHEAD}",
        "the body's sonar counts while driving to the target": (
            f"{LATE_SONAR}; 5.020 In5 2 -> {AHEAD}; 5.050 out2=0 out3=0"
        ),
        "a second object while driving to the target has no effect": (
            f"{TO_TARGET}; 6 In2 1; 6.5 In3 10; 7 In4 0 -> {AHEAD}"
        ),
        "a second object while the first is being located has no effect": (
            "1 In1 1; 2 In2 1; 2.5 In2 1; 3 In3 90; 3.010 In3 180; 3.5 In2 1; 4 In4 0; 5 In4 180; "
            f"6 In4 90 -> {TURNING}; 6.030 out3=1"
        ),
        "a start before the final stop is none": (
            f"{TO_TARGET}; 6 In5 1; 6.019 In1 1; {SECOND_MISSION} -> {AHEAD}; 6.030 out2=0 out3=0"
        ),
        "a start after the final stop is a new mission": (
            f"{TO_TARGET}; 6 In5 1; 6.020 In1 1; {SECOND_MISSION} -> {AHEAD}; 6.030 out2=0 out3=0; "
            "6.040 out2=1 out3=1; 6.050 out1=1; 9.050 out1=2; 12.030 out1=0; 12.040 out2=0 out3=0; "
            f"14.030 {LEFT}; 15.030 out2=1; 16.030 out2=0 out3=0"
        ),
    }
)
def test_a_rule(lines: str) -> None:
    """Events, until when they are played if it matters, and the outputs after the arrow."""
    events, outputs = lines.split(" -> ")
    events, _, until_s = events.partition("; until ")
    assert played(events, float(until_s) if until_s else None) == outputs


@pytest.mark.parametrize(
    ("parameters", "outputs"),
    [
        (
            Parameters(half_sweep=SECOND // 2),
            f"{STARTED}; 1.530 out1=2; 2.030 out1=1; 2.530 out1=2",
        ),
        (Parameters(hop=100 * MILLISECOND), "1.200 out2=1 out3=1; 1.300 out1=1"),
        # at once and in order of port name
        (Parameters(hop=0), "1.000 out1=1 out2=1 out3=1"),
    ],
    ids=["the half sweep", "every hop", "no hop"],
)
def test_a_parameter(parameters: Parameters, outputs: str) -> None:
    assert played("1 In1 1", 3.0, parameters)[: len(outputs)] == outputs


def turned(target: object, *headings: object, tolerance_deg: float = 0.0) -> str:
    """What comes of a mission to a target with these headings at 4.0, 4.1 ... s, once found."""
    read = [f"4.{n} In4 {heading}" for n, heading in enumerate(headings)]
    parameters = Parameters(tolerance_deg=tolerance_deg)
    outputs = played("; ".join([f"1 In1 1; 2 In2 1; 3 In3 {target}", *read]), None, parameters)
    assert outputs.startswith(FOUND)
    return outputs.removeprefix(f"{FOUND}; ")


@pytest.mark.parametrize(
    ("target", "heading", "way"),
    [
        *((200, 50, RIGHT), (50, 200, LEFT), (10, 350, RIGHT), (350, 10, LEFT), (179, 0, RIGHT)),
        *((181, 0, LEFT), (180, 0, LEFT), (0, 180, RIGHT), (90, 270, RIGHT), (270, 90, LEFT)),
        *((45, 45, LEFT), (0, 360, LEFT), (1, 0, RIGHT), (0, 1, LEFT), (380, 10, RIGHT)),
        *((10, 740, LEFT), (-90, 260, RIGHT), (90.5, 90.4, RIGHT)),
    ],
)
def test_the_vehicle_turns_the_shorter_way(target: float, heading: float, way: str) -> None:
    assert turned(target, heading) == f"4.030 {way}"


@pytest.mark.parametrize(
    ("headings", "outputs"),
    [
        ((200, 50, 199, 200), f"4.030 {RIGHT}; 4.230 out3=1"),
        ((50, 200, 51, 50), f"4.030 {LEFT}; 4.230 out2=1"),
        # a heading equal to the target still turns until it is read again
        ((45, 45, 45), f"4.030 {LEFT}; 4.130 out2=1"),
        # a target of 1 degree is no request for the heading
        ((1, 0, 2, 0, 1), f"4.030 {RIGHT}; 4.330 out3=1"),
        ((1, 1, 2, 0, 1), f"4.030 {LEFT}; 4.330 out2=1"),
        ((1, 359, 2, 0, 1), f"4.030 {RIGHT}; 4.330 out3=1"),
    ],
)
def test_after_a_turn_only_the_tread_that_went_back_is_commanded(
    headings: tuple[int, ...], outputs: str
) -> None:
    assert turned(*headings) == outputs


@pytest.mark.parametrize(
    ("target", "tolerance_deg", "readings", "is_match"),
    [
        # equality modulo 360
        *((10, 0, each, True) for each in (370, -350)),
        *((target, 0, reading, True) for target, reading in ((370, 10), (0, 360), (200.1, 560.1))),
        *((200, 0, each, False) for each in (200.001, 199.999, 20, 0)),
        # across north too
        *((0, 3, each, True) for each in (357, 357.5, 0, 2, 3, 362.9)),
        *((0, 3, each, False) for each in (356.9, 3.1, 180)),
    ],
)
def test_what_is_a_match(
    target: float, tolerance_deg: float, readings: float, *, is_match: bool
) -> None:
    outputs = turned(target, 100, readings, tolerance_deg=tolerance_deg)
    assert outputs.count("out") == 2 + is_match
    assert ("4.130 " in outputs) == is_match


EVENTS = st.builds(
    Event,
    st.integers(0, 4000).map(lambda fives: fives * 5 * MILLISECOND),
    st.sampled_from(["In1", "In2", "In3", "In4", "In5"]),
    st.sampled_from([1.0, 2.0, 90.0]),
)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.lists(EVENTS, max_size=60))
def test_a_motor_never_puts_out_what_it_already_does(events: list[Event]) -> None:
    lines = run_events(Detective(), sorted(events), checked=True)
    for port in ("out1", "out2", "out3"):
        values = [0, *(line.value for line in lines if line.port == port)]
        assert all(before != after for before, after in pairwise(values))


# With `mission.avoid_obstacles` it drives past what its radar looks over --------------------------


AVOIDING = Parameters(avoid_obstacles=True, aside=2 * SECOND)
AS_IN_FIGURE_6 = "2 In1 1; 5 In2 1; 6 In3 200; 9 In4 50; 11.050 In4 200"
"""Until the vehicle drives to the target."""


@pytest.mark.parametrize(
    ("events", "since", "outputs"),
    [
        pytest.param(
            # Compass1, the Radar controller and the Movement controller, 10 ms each
            f"{AS_IN_FIGURE_6}; 15 In5 2; 16 In2 2; 17 In3 210",
            "15",
            "15.030 out2=0 out3=0; 15.040 out1=1; 16.030 out1=0; 17.030 out4=1",
            id="what is within reach and ahead is the target",
        ),
        pytest.param(
            # 320 is 120 degrees left of the target: ahead for two seconds, the radar looks again
            f"{AS_IN_FIGURE_6}; 15 In5 2; 16 In2 1; 17 In3 200; 18 In4 319; 19 In4 320",
            "17",
            f"17.040 {RIGHT}; 19.030 out3=1; 21.030 out2=0 out3=0; 21.040 out1=1; 24.040 out1=2; "
            "27.040 out1=1",
            id="what is not within reach stands behind an obstacle that is driven past",
        ),
        pytest.param(
            f"{AS_IN_FIGURE_6}; 15 In5 2; 16 In2 1; 17 In3 200; 19 In4 320; 20 In5 2; 21 In2 1; "
            "22 In3 200; 23 In4 320; 24 In4 200; 25 In5 2; 26 In2 1; 27 In3 200",
            "27",
            f"27.040 {LEFT}",
            id="where the left was blocked the vehicle turns right from then on",
        ),
        pytest.param(
            "2 In1 1; 3 In5 2; 4 In2 1; 4.5 In3 90",
            "3",
            "3.030 out2=0 out3=0; 4.030 out1=0",
            id="an obstacle before the first detection stops the vehicle and not the radar",
        ),
    ],
)
def test_an_obstacle(events: str, since: str, outputs: str) -> None:
    every = played(events, None, AVOIDING).split("; ")
    found = [each for each in every if float(each.split()[0]) >= float(since)]
    assert "; ".join(found)[: len(outputs)] == outputs
    assert len(found) == outputs.count("; ") + 1 or since == "27"


def test_figure_6_begins_alike_and_the_avoiding_model_goes_into_a_file_and_back() -> None:
    model = Detective(parameters=AVOIDING)
    read = parse_model(model_text(model, ATOMIC_CLASSES), "avoiding.ma", ATOMIC_CLASSES)
    assert described(read) == described(model)
    lines = run_events(model, parse_events(figure_6.EVENTS, "", model))
    assert [str(line) for line in lines][:11] == figure_6.OUTPUTS.splitlines()
    assert str(lines[11]) == "00:00:15:040 out1 1"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "settings", "found"),
    [(1, (), True), (2, (), True), (1, ("mission.avoid_obstacles=false",), False)],
    ids=["past the wall", "past it again", "without the option the wall is taken for the target"],
)
def test_a_mission_with_a_low_wall_touches_nothing(
    seed: int, settings: tuple[str, ...], *, found: bool
) -> None:
    ended = mission_past_a_wall(seed, *settings)
    assert (ended["found"], ended["touched"]) == (found, False)


@pytest.mark.slow
def test_without_an_obstacle_it_finds_its_target_as_ever() -> None:
    assert virtual_detective("mission.avoid_obstacles=true").run_mission()["found"] is True
