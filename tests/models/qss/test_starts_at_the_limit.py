"""Events of values that are exactly at their limit when a system starts, or stay near it."""

import pytest

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.models.qss import Simulation, System, When, solve

METHODS = ("QSS1", "QSS2", "QSS3", "LIQSS2")
TOUCHES = (
    *("h crosses floor falling", "h crosses floor", "h <= floor", "h < floor"),
    *("floor >= h", "floor > h", "not h > floor", "not (floor < h)", "h - floor <= 0"),
)
every_method = pytest.mark.parametrize("method", METHODS)
every_wording = pytest.mark.parametrize("touches", TOUCHES)


def ball(
    method: str, touches: str, *, above: float = 0.0, speed: float = 0.0, floor: float = 0.0
) -> System:
    """A ball that rests on its floor once it is as slow as 0.01 m/s."""
    return System(
        states={"h": floor + above, "v": speed},
        parameters={"floor": floor},
        discrete={"rests": 0, "bounces": 0},
        equations={"h": "v", "v": "0 if rests else -9.81"},
        method=method,
        quantum=1e-3,
        events=[
            When(
                touches,
                h="floor if v > -0.01 else h",
                v="0 if v > -0.01 else -0.5*v",
                rests="1 if v > -0.01 else 0",
                bounces="bounces + 1",
            )
        ],
        outputs=["h", "v", "rests", "bounces"],
    )


@every_method
@every_wording
@pytest.mark.parametrize("floor", [0.0, -7.1])
def test_a_ball_at_rest_on_its_floor_stays_there(method: str, touches: str, floor: float) -> None:
    _, values = solve(ball(method, touches, floor=floor), times=[0.001, 0.5, 2.0])
    assert values["h"] == pytest.approx([floor] * 3, abs=1e-3)
    assert values["v"] == [0.0, 0.0, 0.0]
    assert values["bounces"] == [1.0, 1.0, 1.0]


@every_method
@every_wording
def test_a_ball_thrown_up_from_its_floor_has_its_first_event_where_it_comes_down(
    method: str, touches: str
) -> None:
    _, values = solve(ball(method, touches, speed=1.962), times=[0.01, 0.38, 0.42])
    assert values["bounces"] == [0.0, 0.0, 1.0]


@every_method
@every_wording
def test_a_ball_that_goes_down_from_its_floor_turns_at_once(method: str, touches: str) -> None:
    _, values = solve(ball(method, touches, speed=-9.81), times=[0.0, 0.1])
    assert values["bounces"] == [1.0, 1.0]
    assert values["h"][1] == pytest.approx(0.1 * 4.905 - 0.04905, abs=1e-3)


def test_what_leaves_its_limit_by_one_a_second_does_so_at_once() -> None:
    slips = System(
        states={"x": 0.0},
        equations={"x": "1"},
        discrete={"times": 0},
        events=[When("x crosses 0 rising", times="times + 1")],
        outputs=["times"],
    )
    assert solve(slips, times=[0.0])[1]["times"] == [1.0]


@every_method
@every_wording
def test_a_ball_that_bounces_comes_to_rest_on_its_floor(method: str, touches: str) -> None:
    _, values = solve(ball(method, touches, above=0.1, floor=0.3), times=[2.0, 3.0])
    assert values["rests"] == [1.0, 1.0]
    assert values["h"] == pytest.approx([0.3, 0.3], abs=1e-3)
    assert values["bounces"][0] == values["bounces"][1] < 12.0


@pytest.mark.parametrize("method", ["QSS2", "QSS3", "LIQSS2"])
@every_wording
@pytest.mark.parametrize("floor", [0.0, 0.3])
def test_a_ball_at_rest_that_has_no_way_to_stay_there_does_not_fall_in_silence(
    method: str, touches: str, floor: float
) -> None:
    system = System(
        states={"h": floor, "v": 0.0},
        parameters={"floor": floor},
        equations={"h": "v", "v": "-9.81"},
        method=method,
        events=[When(touches, v="-0.8*v")],
    )
    with pytest.raises(ModelError, match="expected events that do not accumulate"):
        Simulation(system).advance(1_000_000_000)


@every_wording
@pytest.mark.parametrize("restitution", [0.8, 0.05])
def test_in_qss1_it_bounces_near_its_floor_in_as_many_steps_as_a_fall(
    touches: str, restitution: float
) -> None:
    def simulated(events: list[When]) -> Simulation:
        system = System(
            states={"h": 0.3, "v": 0.0},
            parameters={"floor": 0.3},
            equations={"h": "v", "v": "-9.81"},
            method="QSS1",
            quantum=1e-2,
            events=events,
        )
        simulation = Simulation(system)
        simulation.advance(1_000_000_000)
        return simulation

    at_rest, falling = simulated([When(touches, v=f"-{restitution}*v")]), simulated([])
    assert at_rest.values["h"] == pytest.approx(0.3, abs=1e-2)
    assert abs(at_rest.values["v"]) < 0.1
    assert 0 < at_rest.model.steps < 2 * falling.model.steps


@every_method
@pytest.mark.parametrize(
    "slips", ["force crosses static rising", "force > static", "force >= static"]
)
@pytest.mark.parametrize("force", ["5 + t", "5 + t*t", "5 + t**4", "6 - cos(t)"])
@pytest.mark.parametrize("sense", [1, -1])
def test_a_mass_at_the_limit_of_sticking_slips_where_the_force_grows(
    method: str, slips: str, force: str, sense: int
) -> None:
    system = System(
        states={"v": 0.0},
        discrete={"slides": 0},
        parameters={"static": 5.0, "sense": sense},
        definitions={"force": f"sense * sense * ({force})"},
        equations={"v": "sense * (force - 4) if slides else 0"},
        method=method,
        events=[When(slips, only_if="slides == 0", slides=1)],
        outputs=["v", "slides"],
    )
    _, values = solve(system, times=[0.0, 0.1])
    assert values["slides"][1] == 1.0
    assert values["v"][1] == pytest.approx(sense * 0.1, rel=0.06)


@every_method
@pytest.mark.parametrize(
    "slips", ["force crosses static rising", "force > static", "force >= static"]
)
@pytest.mark.parametrize("force", ["5 - t", "5 - t*t", "4 + cos(t)", "5"])
def test_a_mass_at_the_limit_of_sticking_stays_where_the_force_does_not_grow(
    method: str, slips: str, force: str
) -> None:
    system = System(
        states={"v": 0.0},
        discrete={"slides": 0},
        parameters={"static": 5.0},
        definitions={"force": force},
        equations={"v": "force - 4 if slides else 0"},
        method=method,
        events=[When(slips, slides=1)],
        outputs=["slides"],
    )
    assert solve(system, times=[0.0, 0.1, 3.0])[1]["slides"] == [0.0, 0.0, 0.0]


@every_method
@pytest.mark.parametrize("slips", ["force crosses 5 rising", "force > 5", "force >= 5"])
def test_a_mass_that_was_long_at_the_limit_of_sticking_slips_once_the_force_grows(
    method: str, slips: str
) -> None:
    system = System(
        states={"force": 5.0},
        discrete={"slides": 0, "rate": 0},
        equations={"force": "rate"},
        method=method,
        events=[When("t >= 1", rate=1), When(slips, slides="slides + 1")],
        outputs=["slides"],
    )
    assert solve(system, times=[0.9, 1.5])[1]["slides"] == [0.0, 1.0]
