"""The loop's delay by stage: data, figures beside the published ones, and plots."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element

from msgspec import Struct

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.known import LOOP_DELAY
from firmware_runtime.lab.experiments.loop_delay import (
    Delays,
    Round,
    delays_of,
    first_back_s,
    rounds_of,
)
from firmware_runtime.lab.experiments.quantities import milliseconds
from firmware_runtime.lab.experiments.run_conditions import between
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.lab.stages.stage import Stage
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.view.line_plot import Curve, LinePlot
from firmware_runtime.view.markup import table

DEFAULT_S: Final = 20.0
"""How long the ramp lasts in each stage unless the command says."""
PUBLISHED: Final[Mapping[Stage, str]] = {
    Stage.NETWORK: "local_delay_ms",
    Stage.REMOTE: "remote_delay_ms",
}
"""What the paper's number is called, by the stage that is like its own."""
PERIODS_S: Final[Mapping[Stage, float]] = {Stage.NETWORK: 0.002, Stage.REMOTE: 0.01}
"""From one value to the next: the first shows delays under a millisecond; behind jitter, values
that are closer to each other overtake each other."""
SETTLING_S: Final = 1.0
"""After the first value that came back: sockets and processes are warm by then."""
SHOWN: Final = 30
"""How many values of the ramp the plot shows: many more, and both lines are one."""


class StageDelays(Struct, frozen=True):
    """The figures of one stage, beside what was published."""

    delays: Delays
    every_s: float
    published_ms: float | None
    lateness_p50_us: float | None
    """Of the controller's run: how long after its instant a value was sent, within the delay."""
    carried_p50_us: float | None
    """Both ways from run to run: sockets, carriers and what is between them; of all frames, also
    of those whose values were overtaken and never came back."""
    between: str


@dataclass(frozen=True, slots=True)
class LoopRuns:
    """What came of it, by stage."""

    rounds: Mapping[Stage, Sequence[Round]]
    figures: Mapping[Stage, StageDelays]

    def plots(self) -> Iterator[tuple[str, LinePlot]]:
        """For each stage the ramp and what came back, as in the paper, and the delay over time."""
        for stage, rounds in self.rounds.items():
            begin = rounds[0].sent_s if rounds else 0.0
            first = rounds[:SHOWN]
            sent = [(each.sent_s - begin, each.value) for each in first]
            back = [(each.back_s - begin, each.value) for each in first if each.back_s is not None]
            curves = Curve("sent", sent), Curve("back", back)
            yield stage.value, LinePlot(f"{LOOP_DELAY.title}, stage {stage}", "s", "ramp", curves)
            over = [
                (each.sent_s - begin, each.delay_ms) for each in rounds if each.delay_ms is not None
            ]
            delay = [Curve("delay", over)]
            yield f"{stage.value}-delay", LinePlot(f"Delay, stage {stage}", "s", "ms", delay)

    def csv(self) -> Iterator[str]:
        """The data, one line a value of the ramp; empty where it did not come."""
        yield "stage,value,sent_s,echoed_s,back_s,delay_ms"
        for stage, rounds in self.rounds.items():
            for each in rounds:
                times = each.sent_s, each.echoed_s, each.back_s, each.delay_ms
                cells = ("" if at is None else f"{at:.9f}" for at in times)
                yield f"{stage},{each.value!r},{','.join(cells)}"

    def numbers(self) -> Element:
        """A table of the figures, a row a stage."""
        head = ("stage", "published", "p50", "p99", "least", "most", "out p50", "return p50")
        more = ("every", "sent late p50", "carried p50", "sent", "back")
        rows = [
            (stage.value, _published(each.published_ms), *_cells(each))
            for stage, each in self.figures.items()
        ]
        return table("Loop delay by stage", (*head, *more), rows)

    def ours(self) -> dict[str, float | None]:
        """The median by the paper's names, and what it leaves open."""
        found: dict[str, float | None] = {}
        for stage, each in self.figures.items():
            name, delays = PUBLISHED[stage], each.delays
            where = name.removesuffix("_delay_ms")
            found[name] = delays.p50_ms
            found[f"{where}_delay_p99_ms"] = delays.p99_ms
            found[f"{where}_delay_least_ms"] = delays.least_ms
            found[f"{where}_delay_most_ms"] = delays.most_ms
            missing = delays.sent - delays.back
            share = 100.0 * missing / delays.sent if delays.sent else None
            found[f"{where}_not_back_percent"] = share
        return found

    def text(self) -> Iterator[str]:
        """The figures for a terminal, beside the published one."""
        for stage, each in self.figures.items():
            delays = each.delays
            published = each.published_ms
            beside = "" if published is None else f"; published: {_published(published)}"
            yield (
                f"{stage}: p50 {milliseconds(delays.p50_ms)}, p99 {milliseconds(delays.p99_ms)}"
                f"{beside}; {delays.back} of {delays.sent} came back, "
                f"one every {each.every_s * 1e3:g} ms; "
                f"{each.between}"
            )
            yield (
                f"  p50 of the legs: out {milliseconds(delays.out_p50_ms)}, return "
                f"{milliseconds(delays.return_p50_ms)}; p50 of what was sent late "
                f"{_us(each.lateness_p50_us)}, of all frames from run to run and back "
                f"{_us(each.carried_p50_us)}"
            )


def run_loop(trial: Trial) -> Findings:
    """Run it in each of these stages. Raises ConfigError for a run that failed."""
    rounds: dict[Stage, Sequence[Round]] = {}
    figures: dict[Stage, StageDelays] = {}
    for stage in trial.stages:
        rounds[stage], figures[stage] = _measured(trial, stage)
    runs = LoopRuns(rounds, figures)
    return Findings(
        ours=runs.ours(),
        sentences=list(runs.text()),
        plots=dict(runs.plots()),
        data={"": runs.csv()},
        tables=[runs.numbers()],
        details={"stages": {str(stage): each for stage, each in figures.items()}},
        between=[f"{stage}: {each.between}" for stage, each in figures.items()],
    )


def _measured(trial: Trial, stage: Stage) -> tuple[Sequence[Round], StageDelays]:
    """What came back in a stage, without its beginning and its end."""
    for_s = trial.choices.for_s or DEFAULT_S
    every_s = trial.choices.every_s or PERIODS_S[stage]
    trial.say(f"{trial.experiment.title}: stage {stage}, {for_s:g} s")
    with trial.run_loop(stage, for_s=for_s, every_s=every_s) as run:
        every, document = rounds_of(run.trace, 0.0), run.document
    since_s = first_back_s(every) + SETTLING_S
    last_s = every[-1].sent_s if every else 0.0
    found = [each for each in every if since_s <= each.sent_s <= last_s - SETTLING_S]
    late = document["controller"]["statistics"]["models"]["ramp"]["lateness_us"]["p50"]
    carried = document["link"]["back"].get("round_trip_us", {}).get("p50")
    published_ms = trial.experiment.paper.get(PUBLISHED[stage])
    delays = delays_of(found)
    if not delays.back:
        fault = f"no value of the ramp came back in {for_s:g} s, the first and last second left out"
        raise ConfigError.of_one(
            f"loop-delay, stage {stage}", fault, expected="some, or --for longer"
        )
    return found, StageDelays(delays, every_s, published_ms, late, carried, between(document))


def _cells(figures: StageDelays) -> list[str]:
    delays = figures.delays
    return [
        milliseconds(delays.p50_ms),
        milliseconds(delays.p99_ms),
        milliseconds(delays.least_ms),
        milliseconds(delays.most_ms),
        milliseconds(delays.out_p50_ms),
        milliseconds(delays.return_p50_ms),
        f"{figures.every_s * 1e3:g} ms",
        _us(figures.lateness_p50_us),
        _us(figures.carried_p50_us),
        str(delays.sent),
        str(delays.back),
    ]


def _published(delay_ms: float | None) -> str:
    return NOTHING if delay_ms is None else f"about {delay_ms:g} ms"


def _us(span_us: float | None) -> str:
    return milliseconds(None if span_us is None else span_us / 1e3)
