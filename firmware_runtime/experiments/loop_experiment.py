"""The loop's delay by stage: data, figures beside the published ones, a plot and a page."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final
from xml.etree.ElementTree import Element

from msgspec import Struct

from firmware_runtime.experiments.conditions import between
from firmware_runtime.experiments.line_plot import Curve, LinePlot
from firmware_runtime.experiments.loop_delay import (
    Delays,
    Round,
    delays_of,
    first_back_s,
    rounds_of,
)
from firmware_runtime.experiments.running import Say, Setup, traced
from firmware_runtime.stages.stage import Stage
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.statistics.page.markup import table

TITLE: Final = "Delay of a loop: a ramp out and back"
PUBLISHED: Final = (
    "Pecker Marcosig, Giribet, Castro: DEVS-over-ROS (DoveR), 2018, Figures 12 and 13.",
    "Local, with both ROS nodes on one PC: in the order of 7 ms, almost constant.",
    "Remote, with both nodes on a Raspberry Pi over WiFi: in the order of 80 ms, varying more.",
)
PUBLISHED_MS: Final[Mapping[Stage, float]] = {Stage.NETWORK: 7.0, Stage.REMOTE: 80.0}
PERIODS_S: Final[Mapping[Stage, float]] = {Stage.NETWORK: 0.002, Stage.REMOTE: 0.01}
"""From one value to the next: the first shows delays under a millisecond; behind jitter, values
that are closer to each other overtake each other."""
SETTLING_S: Final = 1.0
"""After the first value that came back: sockets and processes are warm by then."""
SHOWN_S: Final = 0.5
"""How much of the ramp the plot shows: more, and both lines are one."""


class StageDelays(Struct, frozen=True):
    """The figures of one stage, beside what was published."""

    delays: Delays
    every_s: float
    published_ms: float
    lateness_p50_us: float | None
    """Of the controller's run: how long after its instant a value was sent, within the delay."""
    carried_p50_us: float | None
    """Both ways from run to run: sockets, carriers and what is between them, within the delay."""
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
            first = [each for each in rounds if each.sent_s - begin <= SHOWN_S]
            sent = [(each.sent_s - begin, each.value) for each in first]
            back = [(each.back_s - begin, each.value) for each in first if each.back_s is not None]
            curves = Curve("sent", sent), Curve("back", back)
            yield stage.value, LinePlot(f"{TITLE}, stage {stage}", "s", "ramp", curves)
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
        more = ("every", "sent late p50", "carried p50", "sent", "back", "between the ends")
        rows = [
            (stage.value, f"about {each.published_ms:g} ms", *_cells(each))
            for stage, each in self.figures.items()
        ]
        return table("Loop delay by stage", (*head, *more), rows)

    def text(self) -> Iterator[str]:
        """The figures for a terminal, beside the published one."""
        for stage, each in self.figures.items():
            delays = each.delays
            yield (
                f"{stage}: p50 {_ms(delays.p50_ms)}, p99 {_ms(delays.p99_ms)}; published: about "
                f"{each.published_ms:g} ms; {delays.back} of {delays.sent} came back, "
                f"one every {each.every_s * 1e3:g} ms; "
                f"{each.between}"
            )
            yield (
                f"  p50 of the legs: out {_ms(delays.out_p50_ms)}, return "
                f"{_ms(delays.return_p50_ms)}; of both {_us(each.lateness_p50_us)} were sent late, "
                f"{_us(each.carried_p50_us)} carried from run to run, the rest is the runs' own"
            )


def run_loop(setup: Setup, stages: Sequence[Stage], say: Say) -> LoopRuns:
    """Run it in each of these stages. Raises ConfigError for a run that failed."""
    rounds: dict[Stage, Sequence[Round]] = {}
    figures: dict[Stage, StageDelays] = {}
    for stage in stages:
        say(f"{TITLE}: stage {stage}, {setup.for_s:g} s")
        period_s = PERIODS_S[stage] if setup.loop_s is None else setup.loop_s
        with traced(replace(setup, loop_s=period_s), stage, say) as run:
            every = rounds_of(run.trace, 0.0)
            since_s = first_back_s(every) + SETTLING_S
            last_s = every[-1].sent_s if every else 0.0
            rounds[stage] = found = [
                each for each in every if since_s <= each.sent_s <= last_s - SETTLING_S
            ]
            document = run.document
        late = document["controller"]["statistics"]["models"]["ramp"]["lateness_us"]["p50"]
        carried = document["link"]["back"].get("round_trip_us", {}).get("p50")
        figures[stage] = StageDelays(
            delays_of(found), period_s, PUBLISHED_MS[stage], late, carried, between(document)
        )
    return LoopRuns(rounds, figures)


def _cells(figures: StageDelays) -> list[str]:
    delays = figures.delays
    return [
        _ms(delays.p50_ms),
        _ms(delays.p99_ms),
        _ms(delays.least_ms),
        _ms(delays.most_ms),
        _ms(delays.out_p50_ms),
        _ms(delays.return_p50_ms),
        f"{figures.every_s * 1e3:g} ms",
        _us(figures.lateness_p50_us),
        _us(figures.carried_p50_us),
        str(delays.sent),
        str(delays.back),
        figures.between,
    ]


def _us(span_us: float | None) -> str:
    return _ms(None if span_us is None else span_us / 1e3)


def _ms(span_ms: float | None) -> str:
    return NOTHING if span_ms is None else f"{span_ms:.3f} ms"
