"""The embedded step with static friction: stuck at zero speed while the integral grows, released.

All is found in what the robot itself measured, as the paper does: yaw, its rate, and the command of
the PID, which the paper calls control effort.
"""

from collections.abc import Iterator, Sequence
from typing import Final

from msgspec import Struct

from firmware_boards.tachobot.settings import TachobotSettings
from firmware_runtime.board.roles import Stage
from firmware_runtime.lab.experiments.curve_figures import (
    Stuck,
    first_motion_s,
    slope,
    stuck_intervals,
    value_near,
    within,
)
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Points, Traced, Trial
from firmware_runtime.view.parts import Series, Span, Table, curve, table

FOR_S: Final = 30.0
STILL_RAD_S: Final = 0.015
"""Seven times the gyro's noise: anything slower counts as rest."""
LEAST_S: Final = 0.5
"""Longer than it is as slow as that where it turns back: a tenth of a second."""


class Episode(Struct, frozen=True):
    """One time that it was stuck, and what pushed meanwhile."""

    from_s: float
    until_s: float
    is_released: bool
    error_rad: float
    """Reference minus yaw, in the middle."""
    effort_slope_n_per_s: float | None
    release_effort_n: float
    release_moment_nm: float
    """Moment of that effort at the lever arm."""


class Step(Struct, frozen=True):
    """One stage's step."""

    initial_delay_s: float | None
    """From the start to the first motion."""
    episodes: list[Episode]
    between: str


class _Measured(Struct, frozen=True):
    yaw: Points
    rate: Points
    effort: Points
    true_rate: Points
    between: str


def run(trial: Trial) -> Findings:
    """Run it in each stage chosen; the numbers are those of the last one."""
    settings: TachobotSettings = trial.board.settings
    steps: dict[Stage, Step] = {}
    for stage in trial.stages:
        trial.say(f"{trial.experiment.title}: stage {stage}, {FOR_S:g} s")
        with trial.run(stage, for_s=FOR_S) as ran:
            measured = _measured(ran)
        steps[stage] = _step(measured, settings)
    stage, step = list(steps.items())[-1]
    return Findings(
        ours=_ours(step),
        sentences=list(_said(stage, step)),
        plots=_plots(measured, step.episodes, settings.controller.yaw.reference_rad),
        data={"": _csv(measured)},
        tables=[_table(steps)],
        details={"stages": {str(stage): each for stage, each in steps.items()}},
        between=[f"{stage}: {each.between}" for stage, each in steps.items()],
    )


def _measured(ran: Traced) -> _Measured:
    estimate = "controller.attitude.yaw"
    return _Measured(
        yaw=ran.points(estimate, "position"),
        rate=ran.points(estimate, "rate"),
        effort=ran.points("controller.yaw.command_n"),
        true_rate=ran.points("world.yaw_rate_rad_s"),
        between=ran.between,
    )


def _step(measured: _Measured, settings: TachobotSettings) -> Step:
    found = stuck_intervals(measured.rate, STILL_RAD_S, LEAST_S)
    return Step(
        initial_delay_s=first_motion_s(measured.rate, STILL_RAD_S),
        episodes=[_episode(each, measured, settings) for each in found],
        between=measured.between,
    )


def _episode(stuck: Stuck, measured: _Measured, settings: TachobotSettings) -> Episode:
    pushed = within(measured.effort, stuck.from_s, stuck.until_s)
    middle = (stuck.from_s + stuck.until_s) / 2
    effort = value_near(measured.effort, stuck.until_s)
    return Episode(
        from_s=stuck.from_s,
        until_s=stuck.until_s,
        is_released=stuck.is_released,
        error_rad=settings.controller.yaw.reference_rad - value_near(measured.yaw, middle),
        effort_slope_n_per_s=slope(pushed),
        release_effort_n=effort,
        release_moment_nm=2.0 * settings.world.lever_arm_m * effort,
    )


# What is said of it ------------------------------------------------------------------------------


def _ours(step: Step) -> dict[str, float | None]:
    """The numbers by the paper's names: its first interval, and the last one's beginning."""
    found: dict[str, float | None] = {"initial_delay_s": step.initial_delay_s}
    if step.episodes:
        first = step.episodes[0]
        found["stuck_from_s"] = first.from_s
        found["stuck_until_s"] = first.until_s if first.is_released else None
        found["stuck_error_rad"] = first.error_rad
        found["effort_slope_n_per_s"] = first.effort_slope_n_per_s
        found["release_effort_n"] = first.release_effort_n
        found["release_moment_nm"] = first.release_moment_nm
    if len(step.episodes) > 1:
        found["stuck_again_from_s"] = step.episodes[1].from_s
        found["stuck_again_error_rad"] = step.episodes[1].error_rad
    found["times_stuck"] = float(len(step.episodes))
    return found


def _said(stage: Stage, step: Step) -> Iterator[str]:
    delay = step.initial_delay_s
    yield f"{stage}: first motion at {'never' if delay is None else f'{delay:.2f} s'}"
    for each in step.episodes:
        slope_n_per_s = each.effort_slope_n_per_s or 0.0
        end = f"released at {each.release_effort_n:+.4f} N" if each.is_released else "to the end"
        yield (
            f"{stage}: stuck {each.from_s:.2f} s to {each.until_s:.2f} s, {each.error_rad:+.3f} "
            f"rad from the reference, control effort {slope_n_per_s:+.4f} N/s, {end}"
        )
    if not step.episodes:
        yield f"{stage}: never stuck for {LEAST_S:g} s"


def _plots(
    measured: _Measured, episodes: Sequence[Episode], reference_rad: float
) -> dict[str, Series]:
    """Yaw, speed and control effort, one under the other on one axis of time."""
    spans = [Span(each.from_s, each.until_s, "stuck") for each in episodes]
    ends = (0.0, FOR_S)
    reference = curve("reference", [(0.0, reference_rad), (FOR_S, reference_rad)], "dashed")
    drawn = {
        "": ("Yaw", "rad", [curve("yaw", measured.yaw), reference]),
        "speed": ("Speed", "rad/s", [curve("yaw rate", measured.rate)]),
        "effort": ("Control effort", "N", [curve("control effort", measured.effort)]),
    }
    return {
        name: Series(title, "s", unit, curves, spans, across_ends=ends)
        for name, (title, unit, curves) in drawn.items()
    }


def _csv(measured: _Measured) -> Iterator[str]:
    yield "at_s,yaw_rad,yaw_rate_rad_s,effort_n,true_yaw_rate_rad_s"
    columns = measured.yaw, measured.rate, measured.effort, measured.true_rate
    for (at, yaw), (_, rate), (_, effort), (_, true) in zip(*columns, strict=False):
        yield f"{at:.9f},{yaw!r},{rate!r},{effort!r},{true!r}"


def _table(steps: dict[Stage, Step]) -> Table:
    head = ("stage", "stuck from", "until", "error", "effort slope", "effort at release", "moment")
    rows = [
        (
            stage.value,
            f"{each.from_s:.2f} s",
            f"{each.until_s:.2f} s{'' if each.is_released else ' (end)'}",
            f"{each.error_rad:+.3f} rad",
            f"{each.effort_slope_n_per_s or 0.0:+.4f} N/s",
            f"{each.release_effort_n:+.4f} N",
            f"{each.release_moment_nm:+.4f} N m",
        )
        for stage, step in steps.items()
        for each in step.episodes
    ]
    return table("Each time that it was stuck", head, rows)
