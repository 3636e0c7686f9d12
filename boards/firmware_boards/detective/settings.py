"""The schema of the detective robot's board.toml. Units are in the keys, or named here."""

from typing import Annotated, Literal

from firmware_drivers.tables.compass import CompassTable
from firmware_drivers.tables.sonar import SonarTable
from firmware_drivers.tables.treads import Share, TreadTable
from msgspec import Meta

from firmware_boards.detective.arena_table import ArenaTable
from firmware_boards.detective.parameters import Parameters
from firmware_runtime.board.settings import (
    Address,
    BoardSettings,
    Channel,
    NotNegative,
    Positive,
    Seconds,
    SecondsOrNone,
    Settings,
)
from firmware_runtime.devs.time import seconds


class RadarMotorTable(Settings, frozen=True):
    """The radar's motor on an H-bridge behind a PCA9685."""

    bus: str
    address: Address
    osc_hz: Positive
    frequency_hz: Positive
    pwm_channel: Channel
    in1: Channel
    in2: Channel
    duty: Share
    longest_turn_s: Seconds
    """The head is stopped when no command came for so long: no chip here would stop it."""


class ModelTable(Settings, frozen=True):
    """Parameters that the paper leaves open, as event files run it; see README.md."""

    hop_s: SecondsOrNone
    half_sweep_s: Seconds
    tolerance_deg: NotNegative


class MissionTable(Settings, frozen=True):
    """The model's parameters on a robot, its start, and the failures of hardware that end it."""

    half_sweep_s: Seconds
    tolerance_deg: NotNegative
    start_s: SecondsOrNone
    faults: Annotated[int, Meta(ge=1)]
    """Faults of one device in a row that count as its failure."""
    on_failure: Literal["end", "wait"]
    """`end`: treads and radar stop and the run ends. `wait`: they stop and stay stopped."""
    longest_s: Seconds = 220.0
    """A mission that has not reached its target after so long has failed."""
    avoid_obstacles: bool = False
    """True if the body's sonar looks ahead on every drive; the vehicle drives past what is low."""
    near_m: Positive = 0.75
    """With `avoid_obstacles`: what the radar's sonar finds from here or nearer is within reach."""
    aside_s: Seconds = 8.0
    """With `avoid_obstacles`: how long it drives past an obstacle before it looks again."""


class TurnCheckTable(Settings, frozen=True):
    """Turns commanded against those of a compass: how far apart both may be."""

    full_turn_deg_s: Positive
    """Rate of turn with both treads at full speed against each other, or of the head at it."""
    window_s: Seconds
    """Time for which turns are remembered."""
    tolerance_deg: Positive
    share: NotNegative
    """And so much of the commanded turn more: treads slip, a head stands at its end stops."""
    still_within_deg: Positive = 2.0
    """A heading that is no further from where it was stands still."""
    still_turn_deg: Positive = 15.0
    """Turn that may be commanded while it does."""


class TreadCheckTable(TurnCheckTable, frozen=True):
    """Those of treads, which may be told to go straight."""

    course_deg: Positive = 6.5
    """How far it may turn from a straight course, of late."""


class HeadCheckTable(TurnCheckTable, frozen=True):
    """The same of the head, which has end stops."""

    stop_deg: Positive | None = None
    """How far they are from straight ahead, to either side. None, where the file does not say: a
    head that stands is believed until it turns back, and `still_turn_deg` has to leave time for a
    stop."""
    at_stop_s: Seconds = 1.0
    """How long the head may stand at one, where that is known."""


class DetectiveSettings(BoardSettings, frozen=True, kw_only=True):
    """The whole file."""

    board: Literal["detective"]
    model: ModelTable
    mission: MissionTable
    radar_sonar: SonarTable
    body_sonar: SonarTable
    radar_compass: CompassTable
    body_compass: CompassTable
    radar_motor: RadarMotorTable
    treads: TreadTable
    turn_check: TreadCheckTable | None = None
    """Treads against the body's compass. None, where the file has no table: nothing is compared."""
    head_check: HeadCheckTable | None = None
    """The head's motor against the radar's compass, likewise."""
    world: ArenaTable


def event_parameters(settings: DetectiveSettings) -> Parameters:
    """The model's parameters as event files run it."""
    model, mission = settings.model, settings.mission
    return Parameters(
        seconds(model.hop_s),
        seconds(model.half_sweep_s),
        model.tolerance_deg,
        mission.avoid_obstacles,
        seconds(mission.aside_s),
    )
