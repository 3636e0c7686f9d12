"""What the arena says of a mission that comes to nothing, though no fault was made."""

import math

import pytest
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.worlds.arena import ArenaParameters
from sim_doubles.worlds.arena_judge import ArenaJudge
from sim_doubles.worlds.arena_log import ArenaLog
from tests.support.arena_rig import ArenaRig

ASTERN = ArenaParameters(target=(0.0, -4.0), head_start_deg=0.0)
RIGHT, LEFT = "Ask motor1 to turn right", "Ask motor1 to turn left"
PING = 66 * MILLISECOND


class Judged:
    """An arena with its log, and a judge whose radar counts echoes from nearer than 4.6 m."""

    def __init__(self, parameters: ArenaParameters, threshold_m: float = 4.6) -> None:
        self.rig = ArenaRig(parameters)
        self.log = ArenaLog(self.rig.arena)
        self.missed = ArenaJudge(self.rig.arena, self.log, threshold_m).missed

    def sweep(self, for_s: float) -> list[int]:
        """Turn the head to the right; give the instants of the pings that met something."""
        self.rig.turn_head(0, 1.0)
        return [at for at in range(0, round(for_s * SECOND), PING) if self.log.radar_echoes(at)]


BESIDE = replace(ASTERN, target=(2.0, 0.0))


@pytest.mark.parametrize("begins_with", [(RIGHT,), (LEFT, RIGHT)])
def test_a_head_that_sweeps_past_the_target_is_to_stop_within_a_second(
    begins_with: tuple[str, ...],
) -> None:
    judged = Judged(BESIDE, threshold_m=2.1)
    for at, state in enumerate(begins_with):
        judged.log.enter(at, "radarController", state)
    met, *_ = judged.sweep(4.0)
    assert judged.missed(met + SECOND - 1) is None
    said = judged.missed(met + SECOND)
    assert said == "the target came into its radar's beam 1.0 s ago, and it sweeps on"
    judged.log.enter(met + SECOND, "radarController", "Wait")
    assert judged.missed(met + SECOND) is None


def test_what_is_in_the_beam_as_it_begins_to_sweep_did_not_come_into_it() -> None:
    judged = Judged(BESIDE)
    met, *_ = judged.sweep(4.0)
    judged.log.enter(met, "radarController", RIGHT)
    assert judged.missed(4 * SECOND) is None


@pytest.mark.parametrize(
    ("parameters", "threshold_m"),
    [
        pytest.param(BESIDE, 1.95, id="a target that is hardly near enough"),
        pytest.param(replace(BESIDE, walls=((-5.0, 4.0, -4.0, 4.0),)), 4.6, id="a wall as well"),
    ],
)
def test_a_head_may_sweep_past(parameters: ArenaParameters, threshold_m: float) -> None:
    judged = Judged(parameters, threshold_m)
    judged.log.enter(0, "radarController", RIGHT)
    assert judged.sweep(4.0)
    assert judged.missed(4 * SECOND) is None


@pytest.mark.parametrize("side", [1, -1])
def test_a_turn_to_the_target_is_half_a_turn_at_most(side: int) -> None:
    judged = Judged(ASTERN)
    judged.rig.drive(0, 20 * side, -20 * side)
    judged.log.enter(SECOND, "movementController", "Turn")
    assert judged.missed(4 * SECOND) is None
    said = judged.missed(round(4.2 * SECOND))
    assert said == "it has turned by 206 degrees to face its target"
    judged.log.enter(4 * SECOND, "movementController", "Turned")
    assert judged.missed(9 * SECOND) is None


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("off_deg", "away_m", "said"),
    [
        (15.0, 4.0, None),
        (25.0, 4.0, "it drives 25 degrees beside its target"),
        (170.0, 4.0, "it drives 170 degrees beside its target"),
        (25.0, 1.5, "it drives 25 degrees beside its target"),
        (40.0, 1.0, None),
    ],
)
def test_it_drives_up_to_its_target(
    side: int, off_deg: float, away_m: float, said: str | None
) -> None:
    off = math.radians(side * off_deg)
    target = (2.0 + away_m * math.sin(off), -3.0 + away_m * math.cos(off))
    judged = Judged(replace(ASTERN, start=(2.0, -3.0), target=target))
    assert judged.missed(0) is None
    judged.log.enter(0, "movementController", "Move forward")
    assert judged.missed(0) == said


@pytest.mark.parametrize("side", [1, -1])
def test_it_drives_straight(side: int) -> None:
    judged = Judged(replace(ASTERN, target=(0.0, 40.0)))
    judged.rig.drive(0, 10 + 3 * side, 10 - 3 * side)
    judged.log.enter(SECOND, "movementController", "Move forward")
    assert judged.missed(2 * SECOND) is None
    judged.rig.drive(2 * SECOND, 10 + 4 * side, 10 - 4 * side)
    judged.rig.drive(5 * SECOND, 10 + 3 * side, 10 - 3 * side)
    said = judged.missed(5 * SECOND)
    assert said == "it turned by 39 degrees on the way to its target"
    assert "beside its target" in str(judged.missed(8 * SECOND))
