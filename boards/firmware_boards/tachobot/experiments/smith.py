"""The loop behind 80 ms with a Smith predictor and without one, and with one of a wrong delay.

Each case is run on the doubles in virtual time, the delay being a block before the propellers, and
has its margins from the linear loop. With the shipped gains 80 ms do little harm; the quick ones
are those that a loop without delay would bear.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from msgspec import Struct, structs

from firmware_boards.tachobot.settings import TachobotSettings
from firmware_runtime.board.roles import Stage
from firmware_runtime.lab.experiments.curve_figures import Points, StepResponse, step_response
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.lab.tuning.loop import Gains, Loop, Margins, Predictor, margins
from firmware_runtime.view.parts import Curve, Series, Table, curve, table

AT_S: Final = 2.0
WATCHED_S: Final = 6.0
DELAY_S: Final = 0.08
SENSED_S: Final = 0.01
"""From forces to the sample that shows them, as experiment `identification` finds it."""
QUICK: Final[Mapping[str, float]] = {"controller.yaw.kp": 6.0, "controller.yaw.kd": 1.6}
_DELAYS: Final = (
    ("no_delay", 0.0, None),
    ("without", DELAY_S, None),
    ("smith", DELAY_S, DELAY_S),
    ("smith_delay_50_percent_short", DELAY_S, 0.5 * DELAY_S),
    ("smith_delay_50_percent_long", DELAY_S, 1.5 * DELAY_S),
)
"""Name, delay of the loop, delay that the predictor takes it to have."""


class Case(Struct, frozen=True):
    """One loop: its step on the doubles, and its margins."""

    gains: str
    name: str
    delay_s: float
    predicted_s: float | None
    gain_margin_db: float
    phase_margin_deg: float
    delay_margin_ms: float
    step: StepResponse


def run(trial: Trial) -> Findings:
    """Run every case with both sets of gains."""
    cases: list[Case] = []
    curves: dict[str, list[Curve]] = {"shipped": [], "quick": []}
    for gains, changed in (("shipped", {}), ("quick", QUICK)):
        for name, delay_s, predicted_s in _DELAYS:
            trial.say(f"{trial.experiment.title}: {gains} gains, {name.replace('_', ' ')}")
            settings = _settings(changed, delay_s, predicted_s)
            points = _points(trial, settings, f"{gains}-{name}")
            margin = _margins(trial.board.settings, settings, delay_s, predicted_s)
            cases.append(_case(gains, name, (delay_s, predicted_s), margin, points))
            curves[gains].append(curve(name.replace("_", " "), points))
    return Findings(
        ours=dict(_ours(cases)),
        sentences=list(_sentences(cases)),
        plots={
            gains: Series(f"Step behind 80 ms, {gains} gains", "s since the step", "rad", drawn)
            for gains, drawn in curves.items()
        },
        data={"": _csv(curves)},
        tables=[_table(cases)],
        details={"cases": [structs.asdict(each) for each in cases]},
        between=["simulation: a delay block before the propellers, virtual time"],
    )


def _settings(
    changed: Mapping[str, float], delay_s: float, predicted_s: float | None
) -> dict[str, float]:
    smith = {} if predicted_s is None else {"controller.yaw.smith.delay_s": predicted_s}
    return {**changed, "controller.yaw.delay_s": delay_s, **smith}


def _points(trial: Trial, settings: Mapping[str, object], label: str) -> Points:
    """The true yaw since the step."""
    step = [f"{AT_S:g}:yaw_reference=1.0"]
    for_s = AT_S + WATCHED_S
    with trial.run(
        Stage.SIMULATION, for_s=for_s, inputs=step, settings=settings, label=label
    ) as ran:
        found = ran.points("world.yaw_rad")
    return [(at - AT_S, value) for at, value in found if at >= AT_S - 0.5]


def _margins(
    board: TachobotSettings,
    settings: Mapping[str, float],
    delay_s: float,
    predicted_s: float | None,
) -> Margins:
    yaw = board.controller.yaw
    gains = Gains(
        settings.get("controller.yaw.kp", yaw.kp), yaw.ki, settings.get("controller.yaw.kd", yaw.kd)
    )
    loop = Loop(board.yaw_plant, SENSED_S + delay_s, board.controller.period_s)
    predictor = None if predicted_s is None else Predictor(board.yaw_plant, predicted_s)
    return margins(loop, gains, predictor)


def _case(
    gains: str,
    name: str,
    delays: tuple[float, float | None],
    margin: Margins,
    points: Points,
) -> Case:
    return Case(
        gains,
        name,
        *delays,
        gain_margin_db=margin.gain_db,
        phase_margin_deg=margin.phase_deg,
        delay_margin_ms=1e3 * margin.delay_s,
        step=step_response(points, 0.0, 1.0),
    )


def _ours(cases: Sequence[Case]) -> Iterator[tuple[str, float | None]]:
    for each in cases:
        named = f"{each.gains}_{each.name}"
        yield f"{named}_gain_margin_db", each.gain_margin_db
        yield f"{named}_phase_margin_deg", each.phase_margin_deg
        overshoot = each.step.overshoot
        yield f"{named}_overshoot_percent", None if overshoot is None else 100.0 * overshoot
        yield f"{named}_settling_s", each.step.settling_s


def _sentences(cases: Sequence[Case]) -> Iterator[str]:
    for each in cases:
        yield f"{each.gains} gains, {each.name.replace('_', ' ')}: {', '.join(_cells(each))}"


def _cells(case: Case) -> list[str]:
    step = case.step
    return [
        f"gain margin {case.gain_margin_db:.1f} dB",
        f"phase margin {case.phase_margin_deg:.0f} deg",
        f"{case.delay_margin_ms:.0f} ms more",
        "overshoot unknown" if step.overshoot is None else f"overshoot {step.overshoot:.0%}",
        "never settled" if step.settling_s is None else f"settled after {step.settling_s:.2f} s",
    ]


def _table(cases: Sequence[Case]) -> Table:
    head = ("gains", "loop", "gain margin", "phase margin", "delay margin", "overshoot", "settled")
    rows: list[Sequence[Any]] = [
        (each.gains, each.name.replace("_", " "), *_cells(each)) for each in cases
    ]
    return table("Margins of the linear loop, and the step on the doubles", head, rows)


def _csv(curves: Mapping[str, Sequence[Curve]]) -> Iterator[str]:
    yield "gains,loop,since_step_s,yaw_rad"
    for gains, drawn in curves.items():
        for each in drawn:
            for at, value in each.points:
                yield f"{gains},{each.name},{at:.9f},{value!r}"
