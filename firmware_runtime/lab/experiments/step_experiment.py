"""A board's step in each stage: what was shown over time, its figures, a plot and a page."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from msgspec import Struct

from firmware_runtime.board.experiments import StepExperiment
from firmware_runtime.board.roles import Stage
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.curve_figures import (
    SETTLED,
    Difference,
    Points,
    StepResponse,
    difference,
    step_response,
)
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.quantities import milliseconds
from firmware_runtime.lab.experiments.trial import Traced, Trial
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.view.parts import Curve, Series, Table, curve, on_common_axes, table

_ACROSS: Final = "s since the step"
BEFORE_S = 0.5
"""Time before the step that is kept."""


class StageFigures(Struct, frozen=True):
    """The figures of one stage."""

    response: StepResponse
    from_simulation: Difference | None
    loop_delay_ms: float | None
    """Median delay that the link adds to the loop, out and back; None in one process."""
    between: str


class Answer(NamedTuple):
    """Values of a stage from a little before the step on: seconds since then, and values."""

    points: Points
    beside: Mapping[str, Points]
    """By title, what is drawn as well."""
    loop_delay_ms: float | None
    between: str


def run_step(trial: Trial) -> Findings:
    """Run it in each of these stages, the simulation first. Raises ConfigError for a failed run."""
    experiment = trial.experiment
    assert isinstance(experiment, StepExperiment)  # noqa: S101 -- what is called with one
    answers: dict[Stage, Answer] = {}
    figures: dict[Stage, StageFigures] = {}
    for stage in dict.fromkeys((Stage.SIMULATION, *trial.stages)):  # to compare with
        trial.say(f"{experiment.title}: stage {stage}, {experiment.for_s:g} s")
        answers[stage] = answer = _answer(trial, experiment, stage)
        apart = difference(answer.points, answers[Stage.SIMULATION].points)
        figures[stage] = StageFigures(
            step_response(answer.points, experiment.begin, experiment.end),
            None if stage is Stage.SIMULATION else apart,
            answer.loop_delay_ms,
            answer.between,
        )
    unit = experiment.unit
    return Findings(
        ours={f"reference_{unit}": experiment.end, **dict(_ours(figures, unit))},
        sentences=[_sentence(stage, each, unit) for stage, each in figures.items()],
        plots=_plots(experiment, answers),
        data={"": _csv(experiment, answers)},
        tables=[_table(figures, unit)],
        details={"stages": {str(stage): each for stage, each in figures.items()}},
        between=[f"{stage}: {each.between}" for stage, each in figures.items()],
    )


def _answer(trial: Trial, experiment: StepExperiment, stage: Stage) -> Answer:
    planned = f"{experiment.at_s:g}:{experiment.port}={experiment.end!r}"
    with trial.run(stage, for_s=experiment.for_s, inputs=[planned]) as run:
        port = experiment.answer or run.shown or "no port"
        found = _since(run, port, experiment.at_s)
        beside = {
            title: _since(run, each, experiment.at_s) for title, each in experiment.beside.items()
        }
        back = (run.document["link"] or {}).get("back", {})
        p50_us: float | None = back.get("round_trip_us", {}).get("p50")
        between = run.between
    if not found:
        raise ConfigError.of_one(f"stage {stage}", f"{port} sent nothing", expected="values")
    return Answer(found, beside, None if p50_us is None else p50_us / 1e3, between)


def _since(run: Traced, port: str, step_s: float) -> Points:
    """Values of a port, from a little before the step on."""
    since = [(at - step_s, value) for at, value in run.points(port)]
    return [(at, value) for at, value in since if at >= -BEFORE_S]


# What is said of it ------------------------------------------------------------------------------


def _plots(experiment: StepExperiment, answers: Mapping[Stage, Answer]) -> dict[str, Series]:
    """All stages on common axes with the reference, and what is drawn beside it."""
    until = max((at for each in answers.values() for at, _ in each.points), default=1.0)
    edges = (-BEFORE_S, experiment.begin), (0.0, experiment.begin)
    after = (0.0, experiment.end), (until, experiment.end)
    curves = [curve(stage.value, each.points) for stage, each in answers.items()]
    curves.append(curve("reference", (*edges, *after), "dashed"))
    up = f"{experiment.quantity}, {experiment.unit}"
    plots = {"": _nested(experiment.title, up, curves)}
    for title in experiment.beside:
        curves = [curve(stage.value, each.beside[title]) for stage, each in answers.items()]
        plots[_file_name(title)] = _nested(title, title, curves)
    return on_common_axes(plots)


def _nested(title: str, up: str, curves: Sequence[Curve]) -> Series:
    return Series(title, _ACROSS, up, curves, is_nested=True)


def _file_name(title: str) -> str:
    """The words of a title for a file's name: `Angular speed, rad/s` is `angular-speed`."""
    return "-".join(re.findall(r"[a-z0-9]+", title.partition(",")[0].lower()))


def _csv(experiment: StepExperiment, answers: Mapping[Stage, Answer]) -> Iterator[str]:
    """The data, one line a sample."""
    yield f"stage,since_step_s,{experiment.quantity}_{experiment.unit}"
    for stage, each in answers.items():
        yield from (f"{stage},{at:.9f},{value!r}" for at, value in each.points)


def _table(figures: Mapping[Stage, StageFigures], unit: str) -> Table:
    head = ("stage", "rise time", "overshoot", f"settled within {SETTLED:.0%}", "at the end")
    more = ("from simulation, rms", "largest", "delay of the loop")
    rows = [
        (stage.value, *_cells(each, unit), milliseconds(each.loop_delay_ms))
        for stage, each in figures.items()
    ]
    return table("Figures by stage", (*head, *more), rows)


def _ours(figures: Mapping[Stage, StageFigures], unit: str) -> Iterator[tuple[str, float | None]]:
    """The figures by name, each with its stage before it and its unit behind it."""
    for stage, each in figures.items():
        response, over = each.response, each.response.overshoot
        yield f"{stage}_rise_s", response.rise_s
        yield f"{stage}_overshoot_percent", None if over is None else 100.0 * over
        yield f"{stage}_settling_s", response.settling_s
        yield f"{stage}_final_{unit}", response.final
        if each.from_simulation is not None:
            yield f"{stage}_from_simulation_rms_{unit}", each.from_simulation.rms
        if each.loop_delay_ms is not None:
            yield f"{stage}_loop_delay_ms", each.loop_delay_ms


def _sentence(stage: Stage, figures: StageFigures, unit: str) -> str:
    rise, overshoot, settling, final, rms, largest = _cells(figures, unit)
    apart = f"; from simulation rms {rms}, largest {largest}"
    return (
        f"{stage}: rise {rise}, overshoot {overshoot}, settled {settling}, at the end "
        f"{final}{'' if figures.from_simulation is None else apart}"
    )


def _cells(figures: StageFigures, unit: str) -> list[str]:
    response, apart = figures.response, figures.from_simulation
    overshoot = response.overshoot
    return [
        _seconds(response.rise_s),
        NOTHING if overshoot is None else f"{overshoot:.1%}",
        _seconds(response.settling_s),
        NOTHING if response.final is None else f"{response.final:.4f} {unit}",
        NOTHING if apart is None else f"{apart.rms:.4f} {unit}",
        NOTHING if apart is None else f"{apart.largest:.4f} {unit}",
    ]


def _seconds(span_s: float | None) -> str:
    return "never" if span_s is None else f"{span_s:.3f} s"
