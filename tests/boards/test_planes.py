"""The worlds of our boards from above: each number drawn is one that a port sends."""

import math
from collections.abc import Iterator, Mapping
from functools import partial

import pytest

from firmware_runtime.board.registry import load
from firmware_runtime.board.rigs import rig_for
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock, WorldClock
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.view.parts import Body, Bound, Place, Plane
from sim_doubles.worlds.tachobot_plane import tachobot_plane


def plane_of(board: str) -> Plane:
    plane = getattr(rig_for(load(board), WorldClock()), "plane", None)
    assert isinstance(plane, Plane)
    return plane


def bounds(body: Body) -> Iterator[Bound]:
    yield from (each for each in (body.x, body.y, body.heading_rad) if each is not None)
    yield from (arrow.length for arrow in body.arrows)
    for ray in body.rays:
        yield from (each for each in (ray.length, ray.direction_rad) if each is not None)


def sent_by(board: str, for_s: float) -> Mapping[str, object]:
    """The last value of each port in a run on doubles, as a page gets them."""
    session = start_session(load(board), VirtualClock(), doubles=True, statistics_path=None)
    sent: dict[str, object] = {}
    try:
        simulator = session.executive.simulator
        for atomic in simulator.atomics:
            for port in atomic.out_ports.values():
                simulator.listen(port, partial(_keep, sent, below_root(port.path)))
        assert session.run(round(for_s * SECOND)).error is None
    finally:
        session.close()
    return sent


def _keep(sent: dict[str, object], path: str, _at: int, value: object) -> None:
    sent[path] = plain(value)


def number(bound: Bound, values: Mapping[str, object]) -> object:
    """What a page draws, see `numberOf` of `view/front/plane.js`."""
    value = values[bound.port]
    if isinstance(value, dict):
        value = value[bound.field]
    elif isinstance(value, list):
        value = value[int(bound.field)]
    return value * bound.scale + bound.offset if isinstance(value, int | float) else value


@pytest.mark.slow
@pytest.mark.parametrize(("board", "for_s"), [("tachobot", 3.0), ("detective", 12.0)])
def test_every_number_of_a_body_is_sent_by_a_port(board: str, for_s: float) -> None:
    sent = sent_by(board, for_s)
    for body in plane_of(board).bodies:
        for bound in bounds(body):
            found = number(bound, sent)
            assert isinstance(found, float) or found == "inf", bound


@pytest.mark.slow
def test_the_radar_s_head_looks_where_its_compass_says() -> None:
    sent = sent_by("detective", 3.0)
    _, head = plane_of("detective").bodies
    assert head.heading_rad is not None
    heading_deg = sent["radar_compass.heading_deg"]
    assert isinstance(heading_deg, int)
    assert number(head.heading_rad, sent) == pytest.approx(math.radians(90 - heading_deg))


def test_a_propeller_of_tachobot_pushes_against_its_neighbour() -> None:
    (robot,) = plane_of("tachobot").bodies
    assert len(robot.arrows) == 8
    for first, second in zip(robot.arrows[::2], robot.arrows[1::2], strict=True):
        assert first.at == second.at
        assert second.direction_rad - first.direction_rad == pytest.approx(math.pi)


def test_an_arrow_of_tachobot_is_as_long_as_the_duty_of_its_own_propeller() -> None:
    (robot,) = tachobot_plane(2.0, "free").bodies
    duties = {f"propeller {number + 1}": 0.1 * number for number in range(8)}
    values = {"thrust_pairs.duties": [*duties.values()]}
    drawn = {each.name: number(each.length, values) for each in robot.arrows}
    assert drawn == duties, "of half an arm"


def test_a_tachobot_of_longer_arms_is_drawn_larger() -> None:
    (one,), (two,) = (tachobot_plane(arm_m, "free").bodies for arm_m in (1.0, 2.0))

    def twice(place: Place) -> Place:
        return 2 * place[0], 2 * place[1]

    for small, large in zip(one.shapes, two.shapes, strict=True):
        assert large.points == [twice(each) for each in small.points]
        assert large.radius == 2 * small.radius
    for short, long in zip(one.arrows, two.arrows, strict=True):
        assert (long.at, long.length.scale) == (twice(short.at), 2 * short.length.scale)


def test_a_pair_of_propellers_is_drawn_at_each_end_of_tachobots_bars() -> None:
    (robot,) = plane_of("tachobot").bodies
    ends = {end for shape in robot.shapes if shape.form == "line" for end in shape.points}
    pairs = {each.points[0] for each in robot.shapes if each.name == "a pair of propellers"}
    assert ends == pairs


def test_equal_forces_of_the_pairs_turn_tachobot_as_equation_2_says() -> None:
    (robot,) = plane_of("tachobot").bodies
    moments = [
        x * math.sin(each.direction_rad) - y * math.cos(each.direction_rad)
        for each in robot.arrows[::2]
        for x, y in [each.at]
    ]
    assert [math.copysign(1, each) for each in moments] == [1, -1, 1, -1]
