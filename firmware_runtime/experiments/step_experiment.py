"""A board's step in each stage: what was shown over time, its figures, a plot and a page."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from msgspec import Struct

from firmware_runtime.board.experiments import StepExperiment
from firmware_runtime.errors import ConfigError
from firmware_runtime.experiments.conditions import between
from firmware_runtime.experiments.line_plot import Curve, LinePlot
from firmware_runtime.experiments.running import Say, Setup, traced
from firmware_runtime.experiments.step_response import (
    SETTLED,
    Difference,
    Points,
    StepResponse,
    difference,
    step_response,
)
from firmware_runtime.stages.stage import Stage
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.statistics.page.markup import table

BEFORE_S = 0.5
"""How much of the time before the step is kept."""


class StageFigures(Struct, frozen=True):
    """The figures of one stage."""

    response: StepResponse
    from_simulation: Difference | None
    between: str


@dataclass(frozen=True, slots=True)
class StepRuns:
    """What came of it, by stage."""

    experiment: StepExperiment
    points: Mapping[Stage, Points]
    """Seconds since the step, and the value."""
    figures: Mapping[Stage, StageFigures]

    def plot(self) -> LinePlot:
        """All stages on common axes, and the reference."""
        experiment = self.experiment
        until = max((at for each in self.points.values() for at, _ in each), default=1.0)
        edges = (-BEFORE_S, experiment.begin), (0.0, experiment.begin)
        after = (0.0, experiment.end), (until, experiment.end)
        curves = [Curve(stage.value, points) for stage, points in self.points.items()]
        return LinePlot(
            title=experiment.title,
            across="s since the step",
            up=f"{experiment.quantity}, {experiment.unit}",
            curves=[*curves, Curve("reference", (*edges, *after), is_dashed=True)],
        )

    def csv(self) -> Iterator[str]:
        """The data, one line a sample."""
        yield f"stage,since_step_s,{self.experiment.quantity}_{self.experiment.unit}"
        for stage, points in self.points.items():
            yield from (f"{stage},{at:.9f},{value!r}" for at, value in points)

    def numbers(self) -> Element:
        """A table of the figures, a row a stage."""
        unit = self.experiment.unit
        head = ("stage", "rise time", "overshoot", f"settled within {SETTLED:.0%}", "at the end")
        more = ("from simulation, rms", "largest", "between the ends")
        rows = [
            (stage.value, *_cells(each, unit), each.between) for stage, each in self.figures.items()
        ]
        return table("Figures by stage", (*head, *more), rows)

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


def run_step(
    experiment: StepExperiment, setup: Setup, stages: Sequence[Stage], say: Say
) -> StepRuns:
    """Run it in each of these stages. Raises ConfigError for a run that failed."""
    points: dict[Stage, Points] = {}
    figures: dict[Stage, StageFigures] = {}
    for stage in stages:
        say(f"{experiment.title}: stage {stage}, {experiment.for_s:g} s")
        with traced(setup, stage, say) as run:
            step_s = run.began_s + experiment.at_s
            points[stage] = found = list(_points(run.trace, run.shown, step_s))
            words = between(run.document)
        if not found:
            shown = run.shown or "no port"
            raise ConfigError.of_one(f"stage {stage}", f"{shown} sent nothing; expected values")
        apart = None
        if stage is not Stage.SIMULATION and Stage.SIMULATION in points:
            apart = difference(found, points[Stage.SIMULATION])
        response = step_response(found, experiment.begin, experiment.end)
        figures[stage] = StageFigures(response, apart, words)
    return StepRuns(experiment, points, figures)


def _points(trace: Path, shown: str | None, step_s: float) -> Iterator[tuple[float, float]]:
    """What was shown, from a little before the step on."""
    with trace.open() as file:
        for line in file:
            message = json.loads(line)
            since_s = message["t_ns"] / 1e9 - step_s
            if message["port"] == shown and since_s >= -BEFORE_S:
                yield since_s, message["value"]


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
