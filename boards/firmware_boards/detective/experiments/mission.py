"""A mission in the arena, stage by stage: the way, its time, and where the robot stopped."""

from collections.abc import Iterator, Mapping
from typing import Final

from msgspec import Struct

from firmware_runtime.board.roles import Stage
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Points, Traced, Trial
from firmware_runtime.view.parts import Card, Part, Series, Table, curve, table

LONGEST_S: Final = 240.0


class Mission(Struct, frozen=True):
    """End of a mission in a stage, by the arena's own account."""

    found: bool
    stopped_m: float
    """From the target."""
    turned_deg: float
    time_s: float
    between: str


def run(trial: Trial) -> Findings:
    """Run it in each stage chosen; the picture is that of the first one that can draw."""
    missions: dict[Stage, Mission] = {}
    ways: dict[Stage, Points] = {}
    pictures: dict[str, Part] = {}
    for stage in trial.stages:
        trial.say(f"{trial.experiment.title}: stage {stage}, until it ends")
        with trial.run(stage, for_s=LONGEST_S, is_drawn=not pictures) as ran:
            missions[stage] = _mission(ran)
            ways[stage] = ran.points(ran.shown) if ran.shown else []
            if ran.picture is not None:
                title = f"The arena, stage {stage}"
                pictures["arena"] = Card(title=title, parts=ran.picture.parts)
    curves = [curve(stage.value, way) for stage, way in ways.items()]
    distance = Series("Distance to the target", "s", "m", curves)
    return Findings(
        ours=dict(_ours(missions)),
        sentences=[_said(stage, each) for stage, each in missions.items()],
        plots={**pictures, "": distance},
        data={"": _csv(ways)},
        tables=[_table(missions)],
        details={"stages": {str(stage): each for stage, each in missions.items()}},
        between=[f"{stage}: {each.between}" for stage, each in missions.items()],
    )


def _mission(ran: Traced) -> Mission:
    result = ran.document["result"]
    own = {name: result[name] for name in ("found", "stopped_m", "turned_deg", "time_s")}
    return Mission(**own, between=ran.between)


def _ours(missions: Mapping[Stage, Mission]) -> Iterator[tuple[str, float]]:
    for stage, each in missions.items():
        yield f"{stage}_found", float(each.found)
        yield f"{stage}_stopped_m", each.stopped_m
        yield f"{stage}_time_s", each.time_s


def _said(stage: Stage, mission: Mission) -> str:
    found = "found the target" if mission.found else "did not find the target"
    where = f"stands {mission.stopped_m:.2f} m from it after {mission.time_s:.1f} s"
    return f"{stage}: it {found}, and {where}"


def _csv(ways: Mapping[Stage, Points]) -> Iterator[str]:
    yield "stage,at_s,distance_m"
    for stage, way in ways.items():
        yield from (f"{stage},{at:.9f},{value!r}" for at, value in way)


def _table(missions: Mapping[Stage, Mission]) -> Table:
    head = ("stage", "found", "stopped from it", "turned", "time", "between the ends")
    rows = [
        (
            stage.value,
            "yes" if each.found else "no",
            f"{each.stopped_m:.2f} m",
            f"{each.turned_deg:.1f} deg",
            f"{each.time_s:.1f} s",
            each.between,
        )
        for stage, each in missions.items()
    ]
    return table("How it ended", head, rows)
