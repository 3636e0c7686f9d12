"""The arena's vehicle as a DEVS model of quantized integrators, against its closed form."""

import random

import pytest
from msgspec.structs import replace

from firmware_runtime import open_board
from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.worlds.arena import ArenaParameters
from sim_doubles.worlds.arena_quantized import QUANTUM
from tests.support.arena_rig import ArenaRig

OPEN = ArenaParameters(target=(50.0, 50.0), compass_noise_deg=0.0, right_slip=0.05)


def both(parameters: ArenaParameters) -> tuple[ArenaRig, ArenaRig]:
    return ArenaRig(parameters), ArenaRig(replace(parameters, solver="qss2"))


def test_both_drive_alike_whatever_the_treads_get_and_remember_it() -> None:
    generator, at = random.Random(3), 0  # noqa: S311
    exact, quantized = both(OPEN)
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


@pytest.mark.parametrize(
    "obstacle",
    [
        {"obstacles": ((0.1, 1.0, 0.2),)},
        {"walls": ((-1.0, 0.8, 1.0, 1.2),)},
        {"walls": ((0.05, 0.9, 3.0, 0.9),)},
    ],
)
def test_contact_stops_both_at_the_same_place_for_good(obstacle: dict[str, tuple[float]]) -> None:
    exact, quantized = both(replace(OPEN, **obstacle))
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
        chosen = {"world.solver": solver}
        with open_board("detective", doubles=True, clock="virtual", set=chosen) as board:
            board.run(60.0)
            board.rig.catch_up()  # type: ignore[union-attr]
            arena = board.rig.arena  # type: ignore[union-attr]
            found[solver] = arena.pose(board.now), arena.distance_to_target(board.now)
    (exact, near), (quantized, as_near) = found.values()
    assert 0.0 < near < 0.5
    assert as_near == pytest.approx(near, abs=0.01)
    assert quantized == pytest.approx(exact, abs=0.02)
