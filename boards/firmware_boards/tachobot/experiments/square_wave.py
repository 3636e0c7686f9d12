"""A square wave into the propellers in open loop: the robot beside the plain model of the paper.

The robot's yaw and speed are what it measured itself; the plain model is equation (1) of the paper,
rigid and without friction or lag, and gets the very command that the propellers got.
`measured` is what identification starts from.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import sqrt
from typing import Final

from msgspec import Struct

from firmware_boards.tachobot.settings import TachobotSettings
from firmware_runtime.board.roles import Stage
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Traced, Trial
from firmware_runtime.models.plant import SecondOrderPlant, State
from firmware_runtime.view.parts import Series, Table, curve, on_common_axes, table

AFTER_S: Final = 1.0
"""Time, s, that it is watched after the wave's end."""


class Sample(Struct, frozen=True):
    """One tick: the command that left then, and what the robot took its motion to be."""

    at_s: float
    command_n: float
    yaw_rad: float
    yaw_rate_rad_s: float


class Apart(Struct, frozen=True):
    """Distance of the model from the robot, over the whole wave."""

    yaw_rms_rad: float
    yaw_largest_rad: float
    yaw_rate_rms_rad_s: float


def run(trial: Trial) -> Findings:
    """Run it in each stage chosen; the plots are those of the last one."""
    settings: TachobotSettings = trial.board.settings
    apart: dict[Stage, Apart] = {}
    words: list[str] = []
    for stage in trial.stages:
        for_s = watched_s(settings)
        trial.say(f"{trial.experiment.title}: stage {stage}, {for_s:g} s")
        with trial.run(stage, for_s=for_s) as ran:
            samples = measured(ran)
            if not any(each.command_n for each in samples):
                why = "the outputs never followed the wave; expected a robot that is ready in time"
                raise ConfigError.of_one(f"stage {stage}", why)
            words.append(f"{stage}: {ran.between}")
        states = modelled(plain_model(settings), samples)
        apart[stage] = _apart(samples, states)
    largest = max(samples, key=lambda each: abs(each.yaw_rate_rad_s))
    return Findings(
        ours={
            "largest_yaw_rad": max(abs(each.yaw_rad) for each in samples),
            "largest_yaw_rate_rad_s": abs(largest.yaw_rate_rad_s),
            "model_yaw_rms_rad": apart[stage].yaw_rms_rad,
            "model_yaw_rate_rms_rad_s": apart[stage].yaw_rate_rms_rad_s,
        },
        sentences=[_said(stage, each) for stage, each in apart.items()],
        plots=_plots(samples, states),
        data={"": _csv(samples, states)},
        tables=[_table(apart)],
        details={"stages": {str(stage): each for stage, each in apart.items()}},
        between=words,
    )


def watched_s(settings: TachobotSettings) -> float:
    """Return how long a run with the wave of these settings takes."""
    wave = settings.controller.yaw.wave
    if wave is None:
        raise ValueError("controller.yaw.wave: missing; expected a wave")
    return wave.begin_s + wave.cycles * wave.period_s + settings.imu.calibration_s + AFTER_S


def measured(ran: Traced) -> list[Sample]:
    """Samples that the robot measured, from the first tick of the wave's time on."""
    estimate = "controller.attitude.yaw"
    rates = dict(ran.points(estimate, "rate"))
    commands = dict(ran.points("controller.yaw_wave.level"))
    return [
        Sample(at, commands[at], yaw, rates[at])
        for at, yaw in ran.points(estimate, "position")
        if at in commands
    ]


def plain_model(settings: TachobotSettings) -> SecondOrderPlant:
    """Equation (1): Iz times the angular acceleration is R times the forces, and nothing else."""
    world = settings.world
    return SecondOrderPlant(gain=2.0 * world.lever_arm_m / world.yaw_inertia_kg_m2)


def modelled(plant: SecondOrderPlant, samples: Sequence[Sample]) -> list[State]:
    """The model's state at each sample, at rest at the first, with each command held."""
    states = [plant.rest]
    for before, after in pairwise(samples):
        states.append(plant.after(states[-1], before.command_n, after.at_s - before.at_s))
    return states


def _apart(samples: Sequence[Sample], states: Sequence[State]) -> Apart:
    pairs = list(zip(samples, states, strict=True))
    yaw = [each.yaw_rad - state[0] for each, state in pairs]
    rate = [each.yaw_rate_rad_s - state[1] for each, state in pairs]
    return Apart(_rms(yaw), max(map(abs, yaw)), _rms(rate))


def _rms(values: Sequence[float]) -> float:
    return sqrt(sum(each * each for each in values) / len(values))


def _said(stage: Stage, apart: Apart) -> str:
    return (
        f"{stage}: the plain model is {apart.yaw_rms_rad:.3f} rad (rms) from the robot's yaw, "
        f"{apart.yaw_largest_rad:.3f} rad at most, and {apart.yaw_rate_rms_rad_s:.3f} rad/s (rms) "
        "from its speed"
    )


def _plots(samples: Sequence[Sample], states: Sequence[State]) -> dict[str, Series]:
    """The robot (Figure 14) and the plain model (Figure 15) on the same axes, and what went in."""
    pairs = list(zip(samples, states, strict=True))
    robot = [
        curve("yaw, rad", [(each.at_s, each.yaw_rad) for each in samples]),
        curve("angular speed, rad/s", [(each.at_s, each.yaw_rate_rad_s) for each in samples]),
    ]
    model = [
        curve("yaw, rad", [(each.at_s, state[0]) for each, state in pairs]),
        curve("angular speed, rad/s", [(each.at_s, state[1]) for each, state in pairs]),
    ]
    wave = [curve("yaw command", list(_held(samples)))]
    return on_common_axes(
        {
            "": Series("Measured on the robot's doubles", "s", "rad, rad/s", robot),
            "model": Series("The plain model", "s", "rad, rad/s", model),
            "command": Series("What went into both", "s", "N", wave),
        }
    )


def _held(samples: Sequence[Sample]) -> Iterator[tuple[float, float]]:
    """The command with its edges upright."""
    before = 0.0
    for each in samples:
        if each.command_n != before:
            yield each.at_s, before
        yield each.at_s, each.command_n
        before = each.command_n


def _csv(samples: Sequence[Sample], states: Sequence[State]) -> Iterator[str]:
    yield "at_s,command_n,yaw_rad,yaw_rate_rad_s,model_yaw_rad,model_yaw_rate_rad_s"
    for each, state in zip(samples, states, strict=True):
        own = f"{each.at_s:.9f},{each.command_n!r},{each.yaw_rad!r},{each.yaw_rate_rad_s!r}"
        yield f"{own},{state[0]!r},{state[1]!r}"


def _table(apart: dict[Stage, Apart]) -> Table:
    head = ("stage", "yaw, rms", "yaw, largest", "angular speed, rms")
    rows = [
        (
            stage.value,
            f"{each.yaw_rms_rad:.4f} rad",
            f"{each.yaw_largest_rad:.4f} rad",
            f"{each.yaw_rate_rms_rad_s:.4f} rad/s",
        )
        for stage, each in apart.items()
    ]
    return table("From the robot to the plain model", head, rows)
