"""A board's step in each stage: what was shown over time, its figures, a plot and a page."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple
from xml.etree.ElementTree import Element

from msgspec import Struct

from firmware_runtime.board.experiments import StepExperiment
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.quantities import milliseconds
from firmware_runtime.lab.experiments.run_conditions import between
from firmware_runtime.lab.experiments.running import Traced
from firmware_runtime.lab.experiments.step_response import (
    SETTLED,
    Difference,
    Points,
    StepResponse,
    difference,
    step_response,
)
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.lab.stages.stage import Stage
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.view.line_plot import Curve, LinePlot, on_common_axes
from firmware_runtime.view.markup import table

_ACROSS: Final = "s since the step"
BEFORE_S = 0.5
"""How much of the time before the step is kept."""


class StageFigures(Struct, frozen=True):
    """The figures of one stage."""

    response: StepResponse
    from_simulation: Difference | None
    loop_delay_ms: float | None
    """What the link adds to the loop, out and back, the median; None in a stage of one process."""
    between: str


class Answer(NamedTuple):
    """What came in a stage, from a little before the step on: seconds since then, and values."""

    points: Points
    beside: Mapping[str, Points]
    """By title, what is drawn as well."""
    loop_delay_ms: float | None
    between: str


@dataclass(frozen=True, slots=True)
class StepRuns:
    """What came of it, by stage."""

    experiment: StepExperiment
    answers: Mapping[Stage, Answer]
    figures: Mapping[Stage, StageFigures]

    def plots(self) -> dict[str, LinePlot]:
        """All stages on common axes with the reference, and what is drawn beside it."""
        experiment = self.experiment
        until = max((at for each in self.answers.values() for at, _ in each.points), default=1.0)
        edges = (-BEFORE_S, experiment.begin), (0.0, experiment.begin)
        after = (0.0, experiment.end), (until, experiment.end)
        curves = [Curve(stage.value, each.points) for stage, each in self.answers.items()]
        reference = Curve("reference", (*edges, *after), is_dashed=True)
        up = f"{experiment.quantity}, {experiment.unit}"
        plots = {"": _nested(experiment.title, up, [*curves, reference])}
        for title in experiment.beside:
            curves = [Curve(str(stage), each.beside[title]) for stage, each in self.answers.items()]
            plots[_file_name(title)] = _nested(title, title, curves)
        return on_common_axes(plots)

    def csv(self) -> Iterator[str]:
        """The data, one line a sample."""
        yield f"stage,since_step_s,{self.experiment.quantity}_{self.experiment.unit}"
        for stage, each in self.answers.items():
            yield from (f"{stage},{at:.9f},{value!r}" for at, value in each.points)

    def numbers(self) -> Element:
        """A table of the figures, a row a stage."""
        unit = self.experiment.unit
        head = ("stage", "rise time", "overshoot", f"settled within {SETTLED:.0%}", "at the end")
        more = ("from simulation, rms", "largest", "delay of the loop")
        rows = [
            (stage.value, *_cells(each, unit), milliseconds(each.loop_delay_ms))
            for stage, each in self.figures.items()
        ]
        return table("Figures by stage", (*head, *more), rows)

    def ours(self) -> dict[str, float | None]:
        """The figures by name, each with its stage before it and its unit behind it."""
        unit = self.experiment.unit
        found: dict[str, float | None] = {f"reference_{unit}": self.experiment.end}
        for stage, each in self.figures.items():
            response = each.response
            found[f"{stage}_rise_s"] = response.rise_s
            over = response.overshoot
            found[f"{stage}_overshoot_percent"] = None if over is None else 100.0 * over
            found[f"{stage}_settling_s"] = response.settling_s
            found[f"{stage}_final_{unit}"] = response.final
            if each.from_simulation is not None:
                found[f"{stage}_from_simulation_rms_{unit}"] = each.from_simulation.rms
            if each.loop_delay_ms is not None:
                found[f"{stage}_loop_delay_ms"] = each.loop_delay_ms
        return found

    def text(self) -> Iterator[str]:
        """The figures for a terminal."""
        unit = self.experiment.unit
        for stage, each in self.figures.items():
            rise, overshoot, settling, final, rms, largest = _cells(each, unit)
            apart = f"; from simulation rms {rms}, largest {largest}"
            yield (
                f"{stage}: rise {rise}, overshoot {overshoot}, settled {settling}, at the end "
                f"{final}{'' if each.from_simulation is None else apart}"
            )


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
        response = step_response(answer.points, experiment.begin, experiment.end)
        is_simulation = stage is Stage.SIMULATION
        figures[stage] = StageFigures(
            response, None if is_simulation else apart, answer.loop_delay_ms, answer.between
        )
    return _findings(StepRuns(experiment, answers, figures))


def _findings(runs: StepRuns) -> Findings:
    return Findings(
        ours=runs.ours(),
        sentences=list(runs.text()),
        plots=runs.plots(),
        data={"": runs.csv()},
        tables=[runs.numbers()],
        details={"stages": {str(stage): each for stage, each in runs.figures.items()}},
        between=[f"{stage}: {each.between}" for stage, each in runs.figures.items()],
    )


def _answer(trial: Trial, experiment: StepExperiment, stage: Stage) -> Answer:
    planned = f"{experiment.at_s:g}:{experiment.port}={experiment.end!r}"
    with trial.run(stage, for_s=experiment.for_s, inputs=[planned]) as run:
        port = experiment.answer or run.shown or "no port"
        found = _since(run, port, experiment.at_s)
        beside = {
            title: _since(run, each, experiment.at_s) for title, each in experiment.beside.items()
        }
        delay_ms, words = _loop_delay_ms(run.document), between(run.document)
    if not found:
        raise ConfigError.of_one(f"stage {stage}", f"{port} sent nothing", expected="values")
    return Answer(found, beside, delay_ms, words)


def _nested(title: str, up: str, curves: Sequence[Curve]) -> LinePlot:
    return LinePlot(title, _ACROSS, up, curves, is_nested=True)


def _file_name(title: str) -> str:
    """What stands of a title in a file's name: `Angular speed, rad/s` is `angular-speed`."""
    return "-".join(re.findall(r"[a-z0-9]+", title.partition(",")[0].lower()))


def _loop_delay_ms(document: Mapping[str, Any]) -> float | None:
    """From run to run and back, the median."""
    if document["link"] is None:
        return None
    p50_us: float | None = document["link"]["back"].get("round_trip_us", {}).get("p50")
    return None if p50_us is None else p50_us / 1e3


def _since(run: Traced, port: str, step_s: float) -> Points:
    """What a port sent, from a little before the step on."""
    since = [(at - step_s, value) for at, value in run.points(port)]
    return [(at, value) for at, value in since if at >= -BEFORE_S]


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
