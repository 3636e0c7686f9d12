"""A robot that follows the paper's rules finds its target in the arena, from all around."""

import math

import pytest

from sim_doubles.worlds.arena import ArenaParameters, CompassMounting
from tests.support.arena_mission import ArenaMission

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


@pytest.mark.parametrize("distance_m", [1.0, 2.0, 4.0])
def test_it_stops_in_front_of_a_target_anywhere_around(distance_m: float) -> None:
    for bearing_deg in range(0, 360, 36):
        done = mission(distance_m, bearing_deg)
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
