"""A board's step in each stage: what was shown over time, its figures, a plot and a page."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from msgspec import Struct

from firmware_runtime.board.experiments import StepExperiment
from firmware_runtime.errors import ConfigError
from firmware_runtime.experiments.conditions import between
from firmware_runtime.experiments.findings import Findings
from firmware_runtime.experiments.line_plot import Curve, LinePlot
from firmware_runtime.experiments.step_response import (
    SETTLED,
    Difference,
    Points,
    StepResponse,
    difference,
    step_response,
)
from firmware_runtime.experiments.trial import Trial
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

    def ours(self) -> dict[str, float | None]:
        """The figures by name, each with its stage before it and its unit behind it."""
        found: dict[str, float | None] = {}
        for stage, each in self.figures.items():
            response, unit = each.response, self.experiment.unit
            found[f"{stage}_rise_s"] = response.rise_s
            over = response.overshoot
            found[f"{stage}_overshoot_percent"] = None if over is None else 100.0 * over
            found[f"{stage}_settling_s"] = response.settling_s
            found[f"{stage}_final_{unit}"] = response.final
            if each.from_simulation is not None:
                found[f"{stage}_from_simulation_rms_{unit}"] = each.from_simulation.rms
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
    points: dict[Stage, Points] = {}
    figures: dict[Stage, StageFigures] = {}
    for stage in dict.fromkeys((Stage.SIMULATION, *trial.stages)):  # to compare with
        trial.say(f"{experiment.title}: stage {stage}, {experiment.for_s:g} s")
        points[stage], words = _answer(trial, experiment, stage)
        apart = difference(points[stage], points[Stage.SIMULATION])
        response = step_response(points[stage], experiment.begin, experiment.end)
        is_simulation = stage is Stage.SIMULATION
        figures[stage] = StageFigures(response, None if is_simulation else apart, words)
    return _findings(StepRuns(experiment, points, figures))


def _findings(runs: StepRuns) -> Findings:
    return Findings(
        ours=runs.ours(),
        sentences=list(runs.text()),
        plots={"": runs.plot()},
        data={"": runs.csv()},
        tables=[runs.numbers()],
        details={"stages": {str(stage): each for stage, each in runs.figures.items()}},
        between=[f"{stage}: {each.between}" for stage, each in runs.figures.items()],
    )


def _answer(trial: Trial, experiment: StepExperiment, stage: Stage) -> tuple[Points, str]:
    """What was shown, from a little before the step on, and what was between the ends."""
    planned = f"{experiment.at_s:g}:{experiment.port}={experiment.end!r}"
    with trial.run(stage, for_s=experiment.for_s, inputs=[planned]) as run:
        shown, words = run.shown, between(run.document)
        every = run.points(shown) if shown is not None else []
    since = [(at - experiment.at_s, value) for at, value in every]
    found = [(at, value) for at, value in since if at >= -BEFORE_S]
    if not found:
        sentence = f"{shown or 'no port'} sent nothing; expected values"
        raise ConfigError.of_one(f"stage {stage}", sentence)
    return found, words


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
