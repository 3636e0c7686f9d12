"""How treads move the vehicle: arcs by hand, slip, contact, memory, accuracy, missions."""

import math
import random
from collections.abc import Callable

import numpy as np
import pytest
from msgspec.structs import replace
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from firmware_runtime import open_board
from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.worlds.arena import ArenaParameters, CompassMounting
from sim_doubles.worlds.arena_log import Stay
from sim_doubles.worlds.arena_past import KEPT, Past
from sim_doubles.worlds.arena_quantized import QUANTUM
from sim_doubles.worlds.arena_vehicle import Pose
from tests.support.arena_mission import ArenaMission
from tests.support.arena_rig import M_PER_UNIT_S, ArenaRig

OPEN = ArenaParameters(target=(50.0, 50.0), compass_noise_deg=0.0)
NORTH = math.pi / 2


@pytest.mark.parametrize(("right", "left", "turn"), [(20, -20, 1), (-20, 20, -1)])
def test_right_forward_and_left_backward_turn_anticlockwise_on_the_spot(
    right: int, left: int, turn: int
) -> None:
    rig = ArenaRig(OPEN)
    rig.drive(0, right, left)
    x, y, heading = rig.arena.pose(SECOND)
    assert (x, y) == (0.0, 0.0)
    assert heading - NORTH == pytest.approx(turn * 2 * 20 * M_PER_UNIT_S / 0.25)


def test_a_standing_tread_is_the_centre_of_a_turn_and_motors_that_stop_stop_the_vehicle() -> None:
    rig = ArenaRig(OPEN)
    rig.drive(0, 40, 0)
    quarter = round(0.25 * (math.pi / 2) / (40 * M_PER_UNIT_S) * SECOND)
    assert rig.arena.pose(quarter) == pytest.approx((-0.125, 0.125, math.pi), abs=1e-8)
    rig = ArenaRig(OPEN)
    rig.drive(0, 20, 20)
    rig.motors.put_off_stop(0, 2 * SECOND)
    assert rig.arena.pose(9 * SECOND).y_m == pytest.approx(2 * 20 * M_PER_UNIT_S)


def test_slip_is_lost_from_the_way_of_its_side_and_drawn_by_the_seed() -> None:
    rig = ArenaRig(replace(OPEN, right_slip=0.1))
    rig.drive(0, 20, 20)
    pose = rig.arena.pose(SECOND)
    assert pose.heading_rad - NORTH == pytest.approx(-0.1 * 20 * M_PER_UNIT_S / 0.25)
    straight = ArenaRig(replace(OPEN, right_slip=0.2, left_slip=0.2))
    straight.drive(0, 20, 20)
    assert straight.arena.pose(SECOND).y_m == pytest.approx(0.8 * 20 * M_PER_UNIT_S)
    ends = set()
    for seed in (1, 1, 2):
        rig = ArenaRig(replace(OPEN, slip_std=0.02, seed=seed))
        rig.drive(0, 20, 20)
        ends.add(rig.arena.pose(10 * SECOND))
    assert len(ends) == 2
    assert all(0.0 < abs(heading - NORTH) < 10 * 0.2 * 20 * M_PER_UNIT_S for _, _, heading in ends)


def drive_at_random(reads: int) -> list[Pose]:
    """Poses before each of 60 orders, the arena being read at odd instants in between."""
    orders, odd = random.Random(5), random.Random(reads)  # noqa: S311 -- not for secrets
    rig = ArenaRig(replace(OPEN, obstacles=((0.4, 0.6, 0.1),), right_slip=0.03))
    at, poses = 0, []
    for _ in range(60):
        span = orders.randrange(3 * MILLISECOND, 400 * MILLISECOND)
        for inside in sorted(odd.randrange(span) for _ in range(reads)):
            rig.arena.body_echoes(at + inside)
            rig.arena.radar_bearing_deg(at + inside)
        at += span
        poses.append(rig.arena.pose(at))
        rig.drive(at, orders.randint(-127, 127), orders.randint(-127, 127), orders.randint(0, 10))
    return poses


def test_how_often_it_is_read_changes_no_bit_of_the_motion() -> None:
    poses = drive_at_random(reads=0)
    assert poses == drive_at_random(reads=1) == drive_at_random(reads=7)
    assert math.dist(poses[0][:2], poses[-1][:2]) > 0.3


def test_the_past_is_remembered() -> None:
    rig = ArenaRig(OPEN)
    rig.drive(0, 30, 10, step=3)
    instants = range(0, 3 * SECOND, 37 * MILLISECOND)
    seen = {at: (rig.arena.pose(at), rig.arena.head_angle_rad(at)) for at in instants}
    rig.turn_head(3 * SECOND, 0.5)
    rig.drive(3 * SECOND, -50, 90, step=10)
    rig.arena.pose(8 * SECOND)
    for at, (pose, angle) in seen.items():
        assert rig.arena.pose(at) == pytest.approx(pose, abs=1e-14)
        assert rig.arena.head_angle_rad(at) == pytest.approx(angle, abs=1e-14)


def test_commands_do_not_come_before_the_last_change() -> None:
    rig = ArenaRig(OPEN)
    rig.drive(2 * SECOND, 10, 10)
    with pytest.raises(ValueError, match=r"advanced to 1\.000000000 s, expected .* 2\.000000000 s"):
        rig.arena.advance(SECOND)


# Contact


def test_a_vehicle_that_touches_the_target_stands_there_for_good() -> None:
    rig = ArenaRig(replace(OPEN, target=(0.0, 2.0)))
    rig.drive(0, 20, 20)
    touch_s = (2.0 - 0.10 - 0.15) / (20 * M_PER_UNIT_S)
    assert not rig.arena.collided
    before = rig.arena.pose(round((touch_s - 0.01) * SECOND))
    assert before.y_m < 1.75
    assert not rig.arena.collided
    assert rig.arena.pose(60 * SECOND) == pytest.approx((0.0, 1.75, NORTH), abs=1e-4)
    assert rig.arena.collided
    assert rig.arena.distance_to_target(60 * SECOND) == pytest.approx(0.0, abs=1e-4)
    rig.drive(60 * SECOND, -20, -20)
    assert rig.arena.pose(90 * SECOND).y_m == pytest.approx(1.75, abs=1e-4)
    assert rig.arena.pose(round((touch_s - 0.01) * SECOND)) == pytest.approx(before, abs=1e-12)


def test_contact_found_late_is_where_contact_found_at_once_is() -> None:
    places = set()
    for instants in ((99 * SECOND,), range(0, 100 * SECOND, 99 * MILLISECOND)):
        rig = ArenaRig(replace(OPEN, walls=((-0.9, -3.0, -0.9, 3.0),)))
        rig.drive(0, 25, 20, step=4)
        poses = [rig.arena.pose(at) for at in instants]
        assert rig.arena.collided
        places.add(tuple(round(value, 12) for value in poses[-1]))
        assert -0.9 + 0.15 <= poses[-1].x_m <= -0.9 + 0.15 + 1e-4
    assert len(places) == 1


@pytest.mark.parametrize(
    ("right", "left", "walls"),
    [
        pytest.param(20, 20, ((0.151, -1.0, 0.151, 3.0),), id="passes by"),
        pytest.param(20, -20, ((0.1505, -1.0, 0.1505, 1.0),), id="turns on the spot beside a wall"),
    ],
)
def test_a_vehicle_touches_nothing_that(
    right: int, left: int, walls: tuple[tuple[float, float, float, float]]
) -> None:
    rig = ArenaRig(replace(OPEN, walls=walls, obstacles=((-0.5, 1.0, 0.34),)))
    rig.drive(0, right, left)
    driven_m = (right + left) / 2 * 20 * M_PER_UNIT_S
    assert rig.arena.pose(20 * SECOND).y_m == pytest.approx(driven_m)
    assert not rig.arena.collided


def test_a_grazed_corner_stops_it_and_only_so_much_of_the_past_is_kept() -> None:
    rig = ArenaRig(replace(OPEN, walls=((0.149, 1.0, 0.5, 1.0),)))
    rig.drive(0, 20, 20)
    contact = 1.0 - math.sqrt(0.15**2 - 0.149**2)
    assert rig.arena.pose(20 * SECOND).y_m == pytest.approx(contact, abs=2e-3)
    assert rig.arena.collided
    past: Past[Stay] = Past()
    for since in range(10, KEPT + 11):
        past.add(Stay("moving", since, since + 1))
    assert past.at(12).since == 12
    assert past.at(KEPT * 2).since == KEPT + 10
    with pytest.raises(ValueError, match=r"0\.000000010 s, .* 20000 changes"):
        past.at(10)


Vector = NDArray[np.float64]

FAR = ArenaParameters(target=(500.0, 500.0), right_slip=0.02, left_slip=0.05)
LEFT_M, RIGHT_M = 0.05 * 0.95, 0.05 * 0.98


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_minute_of_random_ramps_stays_on_a_tight_solution(seed: int) -> None:
    choice = np.random.default_rng(seed)
    rig, at, worst = ArenaRig(FAR), 0, 0.0
    reference = np.array(rig.arena.pose(0))
    while at < 60 * SECOND:
        until = at + int(choice.integers(3_000_001, 1_500_000_001))
        reference = solved(rig, reference, at, until)
        at = until
        worst = max(worst, float(np.abs(reference - rig.arena.pose(at)).max()))
        right, left, step = (int(n) for n in choice.integers((-127, -127, 0), (128, 128, 11)))
        rig.drive(at, right, left, step)
    assert worst < 1e-10
    assert np.abs(reference[:2]).max() > 0.5  # it went somewhere


def solved(rig: ArenaRig, pose: Vector, since: int, until: int) -> Vector:
    """The pose at `until`, integrated over each stretch of even speeds."""
    for stretch in rig.motors.stretches(since, until):
        right, left = stretch.speeds_rad_s
        solution = solve_ivp(
            derivative(right * RIGHT_M, left * LEFT_M),
            (0.0, (stretch.until - stretch.since) / SECOND),
            pose,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
        )
        pose = solution.y[:, -1]
    return pose


def derivative(right_m_s: float, left_m_s: float) -> Callable[[float, Vector], Vector]:
    """How the pose changes with these speeds of the treads."""
    speed, rate = 0.5 * (right_m_s + left_m_s), (right_m_s - left_m_s) / 0.25
    return lambda _t, z: np.array([speed * np.cos(z[2]), speed * np.sin(z[2]), rate])


SLIPPING = ArenaParameters(target=(50.0, 50.0), compass_noise_deg=0.0, right_slip=0.05)


def both(parameters: ArenaParameters) -> tuple[ArenaRig, ArenaRig]:
    return ArenaRig(parameters), ArenaRig(replace(parameters, solver="qss2"))


def test_both_drive_alike_whatever_the_treads_get_and_remember_it() -> None:
    generator, at = random.Random(3), 0  # noqa: S311
    exact, quantized = both(SLIPPING)
    instants = []
    for _ in range(25):
        right, left = generator.randrange(-60, 61), generator.randrange(-60, 61)
        for rig in (exact, quantized):
            rig.drive(at, right, left, step=20)
        for _ in range(3):
            at += generator.randrange(1, 150 * MILLISECOND)
            instants.append(at)
            assert quantized.arena.pose(at) == pytest.approx(exact.arena.pose(at), abs=20 * QUANTUM)
    assert max(map(abs, exact.arena.pose(at)[:2])) > 0.1
    for earlier in generator.sample(instants, 20):
        pose = exact.arena.pose(earlier)
        assert quantized.arena.pose(earlier) == pytest.approx(pose, abs=20 * QUANTUM)


def test_both_drive_alike_where_nothing_asked_between_two_orders() -> None:
    exact, quantized = both(SLIPPING)
    for rig in (exact, quantized):
        rig.drive(0, 60, -20, step=20)
        rig.drive(SECOND, -20, 60)  # at once
        rig.drive(2 * SECOND, 40, 30, step=20)
    pose = exact.arena.pose(3 * SECOND)
    assert quantized.arena.pose(3 * SECOND) == pytest.approx(pose, abs=20 * QUANTUM)


@pytest.mark.parametrize("after", [0, 500, SECOND])
def test_a_push_turns_both_from_its_instant_on_however_soon_it_comes(after: int) -> None:
    for rig in both(OPEN):
        rig.drive(0, 20, 20)
        rig.drive(SECOND, 30, 30)
        before = rig.arena.pose(SECOND + after - 1).heading_rad
        rig.arena.push(SECOND + after, 0.5)
        poses = [rig.arena.pose(SECOND + after + late) for late in (-1, 0, MILLISECOND)]
        turned = [pose.heading_rad - before for pose in poses]
        assert turned == pytest.approx([0.0, 0.5, 0.5], abs=QUANTUM)


@pytest.mark.parametrize(
    "obstacle",
    [
        {"obstacles": ((0.1, 1.0, 0.2),)},
        {"walls": ((-1.0, 0.8, 1.0, 1.2),)},
        {"walls": ((0.05, 0.9, 3.0, 0.9),)},
    ],
)
def test_contact_stops_both_at_the_same_place_for_good(obstacle: dict[str, tuple[float]]) -> None:
    exact, quantized = both(replace(SLIPPING, **obstacle))
    for rig in (exact, quantized):
        rig.drive(0, 60, 60)
        assert not rig.arena.collided
    for at in (SECOND, 4 * SECOND, 9 * SECOND):
        assert quantized.arena.pose(at) == pytest.approx(exact.arena.pose(at), abs=5e-4)
    assert exact.arena.collided
    assert quantized.arena.collided


@pytest.mark.slow
def test_a_mission_ends_in_front_of_the_target_on_either() -> None:
    found = {}
    for solver in ("exact", "qss2"):
        chosen = {"world.solver": solver, "world.target": [-0.6, 0.35]}
        with open_board("detective", doubles=True, clock="virtual", set=chosen) as board:
            board.run(20.0)
            board.rig.catch_up()  # type: ignore[union-attr]
            arena = board.rig.arena  # type: ignore[union-attr]
            found[solver] = arena.pose(board.now), arena.distance_to_target(board.now)
    (exact, near), (quantized, as_near) = found.values()
    assert 0.0 < near < 0.5
    assert as_near == pytest.approx(near, abs=0.01)
    assert quantized == pytest.approx(exact, abs=0.02)


NEAREST_M, FARTHEST_M = 0.05, 0.5


def mission(
    distance_m: float, bearing_deg: float, mounting: CompassMounting = "inverted"
) -> ArenaMission:
    east = math.radians(90.0 - bearing_deg)
    done = ArenaMission(
        ArenaParameters(
            target=(distance_m * math.cos(east), distance_m * math.sin(east)),
            head_limit_deg=180.0,
            compass_mounting=mounting,
        )
    )
    done.run()
    return done


def test_it_stops_in_front_of_a_target_anywhere_around() -> None:
    for bearing_deg in range(0, 360, 36):
        done = mission(1.0 + bearing_deg / 120, bearing_deg)
        assert NEAREST_M < done.rig.arena.distance_to_target(done.at) < FARTHEST_M
        assert not done.rig.arena.collided


@pytest.mark.parametrize(
    ("mounting", "least", "most"), [("inverted", 0, 180), ("upright", 180, 360)]
)
def test_the_papers_rule_turns_the_shorter_way_with_inverted_compasses_only(
    mounting: CompassMounting, least: float, most: float
) -> None:
    done = mission(2.0, 60.0, mounting)
    turned = math.degrees(abs(done.rig.arena.pose(done.at).heading_rad - math.pi / 2))
    assert least < turned < most


def test_the_same_seed_gives_the_same_run() -> None:
    first, second = mission(2.0, 200.0), mission(2.0, 200.0)
    assert first.rig.arena.pose(first.at) == second.rig.arena.pose(second.at)
    assert first.log.radar_pings == second.log.radar_pings
    assert len(first.log.radar_pings) > 20
