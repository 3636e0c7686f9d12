"""What the detective's rig says of missions that go wrong though nothing was done to it."""

from collections.abc import Callable

import pytest
from firmware_boards.detective import mission
from firmware_boards.detective.angles import shorter_way_grows
from firmware_boards.detective.sensors import Compass2
from firmware_drivers.chips import md25
from firmware_drivers.sonar import Sonar

from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.watched import EVERY, Watched

MISSION = Mission(board="detective")
Plant = Callable[[pytest.MonkeyPatch], None]

pytestmark = pytest.mark.slow


def said_of(until: float) -> str | None:
    """Run on until its rig says something, or an instant, s; return that."""
    with MISSION.opened() as robot:
        watched = Watched(robot)
        while watched.at + EVERY <= until * 1e9 and watched.outcome is None:
            watched.go_on()
            if (said := watched.asked.judged() or watched.asked.missed()) is not None:
                return said
    return None


def hears_nothing(patch: pytest.MonkeyPatch) -> None:
    """No ping is a detection."""
    patch.setattr(Sonar, "_judge", lambda _sonar, _distance: None)


def turns_the_longer_way(patch: pytest.MonkeyPatch) -> None:
    """The sense of the turn is the other one."""
    patch.setattr(
        "firmware_boards.detective.movement_system.shorter_way_grows",
        lambda heading, target: not shorter_way_grows(heading, target),
    )


def turns_too_far(patch: pytest.MonkeyPatch) -> None:
    """Its heading matches 30 degrees beside the target's."""
    match = Compass2._is_match
    patch.setattr(
        Compass2, "_is_match", lambda self, reading, kept: match(self, reading + 30.0, kept)
    )


def ends_at_its_first_stop(patch: pytest.MonkeyPatch) -> None:
    """One stop is taken for two."""
    patch.setattr(mission, "STOPS", 1)


def drives_twice_as_fast(patch: pytest.MonkeyPatch) -> None:
    """Full speed is another number of steps."""
    patch.setattr(md25, "FULL", 255)


@pytest.mark.parametrize(
    ("plant", "says"),
    [
        (hears_nothing, "came into its radar's beam"),
        (turns_the_longer_way, "degrees to face its target"),
        (turns_too_far, "degrees beside its target"),
        (ends_at_its_first_stop, "says that it has found its target"),
        (drives_twice_as_fast, "of full speed"),
    ],
)
def test_a_mission_that_comes_to_nothing_is_wrong_without_any_fault(
    monkeypatch: pytest.MonkeyPatch, plant: Plant, says: str
) -> None:
    plant(monkeypatch)
    said = said_of(16.0)
    assert said is not None
    assert says in said


def test_a_whole_mission_is_sound() -> None:
    assert said_of(40.0) is None
