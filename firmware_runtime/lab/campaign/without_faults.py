"""A mission in which no fault is made, for longer than it is struck, and in other settings, too."""

from typing import Final

from msgspec.structs import replace

from firmware_runtime.board.assignments import assigned
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.lab.campaign.asked import Oracle
from firmware_runtime.lab.campaign.healthy import Healthy, healthy
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.watched import Watched
from firmware_runtime.lab.campaign.wrong import Wrong, broken_by_itself, wrong_by_itself

_MINUTE: Final = 60 * SECOND
"""How long it goes on once, so that what grows slowly, or is done seldom, is seen."""


def wrong_without_faults(mission: Mission, oracle: Oracle | None = None) -> Wrong | None:
    """Return what is wrong with a mission in which no fault is made, or with it later on.

    An oracle of a campaign judges it, too. It goes on for a minute, and to its end where it ends by
    itself; so it does in each setting that its rig names, and the mission does not choose.
    """
    found = healthy(mission)
    if found.wrong is not None:
        return found.wrong
    wrong = _wrong_later(mission, found, oracle)
    for setting in found.stated.also_in:
        if wrong is None and assigned(setting)[0] not in mission.settings():
            wrong = _wrong_in(setting, found)
    return wrong


def _wrong_in(setting: str, found: Healthy) -> Wrong | None:
    """Return what is wrong with a mission in another setting. Raises ConfigError for none."""
    mission = replace(found.mission, assignments=(*found.mission.assignments, setting))
    try:
        wrong = _wrong_later(mission, found)
    except ConfigError as error:
        fault = f"{setting}: {'; '.join(error.faults)}"
        raise ConfigError(f"{mission.board}: also_in of its rig", [fault]) from error
    return None if wrong is None else replace(wrong, setting=setting)


def _wrong_later(mission: Mission, found: Healthy, oracle: Oracle | None = None) -> Wrong | None:
    wrong = None
    try:
        with mission.running() as robot:
            watched, until = Watched(robot, found.not_finite, oracle), _MINUTE
            if robot.session.robot.ended is not None:
                until = max(until, seconds(robot.board.doubles_run_s))
            while wrong is None and watched.at < until and watched.outcome is None:
                watched.go_on()
                wrong = wrong_by_itself(watched, found.stated) or broken_by_itself(watched)
    except HalError:  # what is wrong may keep it from being made safe
        if wrong is None:
            raise
    return wrong
