"""Delay of a loop by stage: a ramp out and back, its figures beside the published ones, plots."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from msgspec import Struct

from firmware_runtime.board.roles import Stage
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.known import LOOP_DELAY
from firmware_runtime.lab.experiments.loop_model import BACK, ECHOED, SENT
from firmware_runtime.lab.experiments.quantities import milliseconds
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.lab.quantile import quantile
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.view.parts import Series, Table, curve, table

DEFAULT_S: Final = 20.0
"""Length of the ramp, s, in each stage unless the command says."""
PUBLISHED: Final[Mapping[Stage, str]] = {
    Stage.NETWORK: "local_delay_ms",
    Stage.REMOTE: "remote_delay_ms",
}
"""Name of the paper's number, by the stage that is like its own."""
PERIODS_S: Final[Mapping[Stage, float]] = {Stage.NETWORK: 0.002, Stage.REMOTE: 0.01}
"""From one value to the next: the first shows delays under a millisecond; behind jitter, values
that are closer to each other overtake each other."""
SETTLING_S: Final = 1.0
"""After the first value that came back: sockets and processes are warm by then."""
SHOWN: Final = 30
"""Values of the ramp in the plot: with many more, both lines are one."""


class Round(Struct, frozen=True):
    """One value of the ramp: when it was sent, sent back, and there again, s; None: never."""

    value: float
    sent_s: float
    echoed_s: float | None
    back_s: float | None

    @property
    def delay_ms(self) -> float | None:
        """From sent to back."""
        return _span_ms(self.sent_s, self.back_s)


class Delays(Struct, frozen=True):
    """Figures of a ramp's values; times in ms, None where nothing came back."""

    sent: int
    back: int
    p50_ms: float | None
    p99_ms: float | None
    least_ms: float | None
    most_ms: float | None
    out_p50_ms: float | None
    """From the instant at which a value was due, to the other end."""
    return_p50_ms: float | None


class StageDelays(Struct, frozen=True):
    """The figures of one stage, beside what was published."""

    delays: Delays
    every_s: float
    published_ms: float | None
    lateness_p50_us: float | None
    """Lateness at which the controller's run sent a value, within the delay."""
    carried_p50_us: float | None
    """Both ways from run to run: sockets, carriers and what is between them; of all frames, also
    of those whose values were overtaken and never came back."""
    between: str


def run_loop(trial: Trial) -> Findings:
    """Run it in each of these stages. Raises ConfigError for a run that failed."""
    rounds: dict[Stage, Sequence[Round]] = {}
    figures: dict[Stage, StageDelays] = {}
    for stage in trial.stages:
        rounds[stage], figures[stage] = _measured(trial, stage)
    return Findings(
        ours=_ours(figures),
        sentences=list(_sentences(figures)),
        plots=dict(_plots(rounds)),
        data={"": _csv(rounds)},
        tables=[_table(figures)],
        details={"stages": {str(stage): each for stage, each in figures.items()}},
        between=[f"{stage}: {each.between}" for stage, each in figures.items()],
    )


def _measured(trial: Trial, stage: Stage) -> tuple[Sequence[Round], StageDelays]:
    """Rounds of a stage, without its beginning and its end."""
    for_s = trial.plan.for_s or DEFAULT_S
    every_s = trial.plan.loop_s or PERIODS_S[stage]
    trial.say(f"{trial.experiment.title}: stage {stage}, {for_s:g} s")
    with trial.run(stage, for_s=for_s, loop_s=every_s) as run:
        every, document, between = rounds_of(run.trace), run.document, run.between
    found = settled(every)
    delays = delays_of(found)
    if not delays.back:
        fault = f"no value of the ramp came back in {for_s:g} s, the first and last second left out"
        raise ConfigError.of_one(
            f"loop-delay, stage {stage}", fault, expected="some, or --for longer"
        )
    return found, StageDelays(
        delays=delays,
        every_s=every_s,
        published_ms=trial.experiment.paper.get(PUBLISHED[stage]),
        lateness_p50_us=document["controller"]["statistics"]["models"]["ramp"]["lateness_us"][
            "p50"
        ],
        carried_p50_us=document["link"]["back"].get("round_trip_us", {}).get("p50"),
        between=between,
    )


def rounds_of(trace: Path) -> list[Round]:
    """All rounds of a merged trace, in order."""
    when: dict[str, dict[float, float]] = {SENT: {}, ECHOED: {}, BACK: {}}
    with trace.open() as file:
        for line in file:
            message = json.loads(line)
            if (found := when.get(message["port"])) is not None:
                found.setdefault(message["value"], message["t_ns"] / SECOND)
    return [
        Round(value, sent_s, when[ECHOED].get(value), when[BACK].get(value))
        for value, sent_s in sorted(when[SENT].items())
    ]


def settled(rounds: Sequence[Round]) -> list[Round]:
    """Rounds from a second after the first that came back, when the link was up, but the last."""
    first_s = next((each.sent_s for each in rounds if each.back_s is not None), 0.0)
    last_s = rounds[-1].sent_s if rounds else 0.0
    return [e for e in rounds if first_s + SETTLING_S <= e.sent_s <= last_s - SETTLING_S]


def delays_of(rounds: Sequence[Round]) -> Delays:
    """Figures of these rounds."""
    spans = (
        [each.delay_ms for each in rounds],
        [_span_ms(each.sent_s, each.echoed_s) for each in rounds],
        [_span_ms(each.echoed_s, each.back_s) for each in rounds],
    )
    delays, out, back = (sorted(each for each in span if each is not None) for span in spans)
    return Delays(
        sent=len(rounds),
        back=len(delays),
        p50_ms=quantile(delays, 0.5),
        p99_ms=quantile(delays, 0.99),
        least_ms=delays[0] if delays else None,
        most_ms=delays[-1] if delays else None,
        out_p50_ms=quantile(out, 0.5),
        return_p50_ms=quantile(back, 0.5),
    )


def _span_ms(from_s: float | None, until_s: float | None) -> float | None:
    return None if from_s is None or until_s is None else (until_s - from_s) * 1e3


# What is said of it ------------------------------------------------------------------------------


def _plots(rounds: Mapping[Stage, Sequence[Round]]) -> Iterator[tuple[str, Series]]:
    """For each stage the ramp and what came back, as in the paper, and the delay over time."""
    for stage, every in rounds.items():
        begin, first = every[0].sent_s, every[:SHOWN]
        sent = [(each.sent_s - begin, each.value) for each in first]
        back = [(each.back_s - begin, each.value) for each in first if each.back_s is not None]
        curves = curve("sent", sent), curve("back", back)
        yield stage.value, Series(f"{LOOP_DELAY.title}, stage {stage}", "s", "ramp", curves)
        delays = [(e.sent_s - begin, e.delay_ms) for e in every if e.delay_ms is not None]
        delay = [curve("delay", delays)]
        yield f"{stage.value}-delay", Series(f"Delay, stage {stage}", "s", "ms", delay)


def _csv(rounds: Mapping[Stage, Sequence[Round]]) -> Iterator[str]:
    """The data, one line a value of the ramp; empty where it did not come."""
    yield "stage,value,sent_s,echoed_s,back_s,delay_ms"
    for stage, every in rounds.items():
        for each in every:
            times = each.sent_s, each.echoed_s, each.back_s, each.delay_ms
            cells = ("" if at is None else f"{at:.9f}" for at in times)
            yield f"{stage},{each.value!r},{','.join(cells)}"


def _table(figures: Mapping[Stage, StageDelays]) -> Table:
    head = ("stage", "published", "p50", "p99", "least", "most", "out p50", "return p50")
    more = ("every", "sent late p50", "carried p50", "sent", "back")
    rows = []
    for stage, each in figures.items():
        found = each.delays
        spans = [found.p50_ms, found.p99_ms, found.least_ms, found.most_ms]
        spans += found.out_p50_ms, found.return_p50_ms
        own = _us(each.lateness_p50_us), _us(each.carried_p50_us), str(found.sent), str(found.back)
        published = _published(each.published_ms)
        every = f"{each.every_s * 1e3:g} ms"
        rows.append((stage.value, published, *map(milliseconds, spans), every, *own))
    return table("Loop delay by stage", (*head, *more), rows)


def _ours(figures: Mapping[Stage, StageDelays]) -> dict[str, float | None]:
    """The median by the paper's names, and what it leaves open."""
    found: dict[str, float | None] = {}
    for stage, each in figures.items():
        name, delays = PUBLISHED[stage], each.delays
        where = name.removesuffix("_delay_ms")
        found[name] = delays.p50_ms
        found[f"{where}_delay_p99_ms"] = delays.p99_ms
        found[f"{where}_delay_least_ms"] = delays.least_ms
        found[f"{where}_delay_most_ms"] = delays.most_ms
        missing = delays.sent - delays.back
        found[f"{where}_not_back_percent"] = 100.0 * missing / delays.sent
    return found


def _sentences(figures: Mapping[Stage, StageDelays]) -> Iterator[str]:
    """The figures for a terminal, beside the published one."""
    for stage, each in figures.items():
        delays, published = each.delays, each.published_ms
        beside = "" if published is None else f"; published: {_published(published)}"
        yield (
            f"{stage}: p50 {milliseconds(delays.p50_ms)}, p99 {milliseconds(delays.p99_ms)}"
            f"{beside}; {delays.back} of {delays.sent} came back, "
            f"one every {each.every_s * 1e3:g} ms; {each.between}"
        )
        yield (
            f"  p50 of the legs: out {milliseconds(delays.out_p50_ms)}, return "
            f"{milliseconds(delays.return_p50_ms)}; p50 of what was sent late "
            f"{_us(each.lateness_p50_us)}, of all frames from run to run and back "
            f"{_us(each.carried_p50_us)}"
        )


def _published(delay_ms: float | None) -> str:
    return NOTHING if delay_ms is None else f"about {delay_ms:g} ms"


def _us(span_us: float | None) -> str:
    return milliseconds(None if span_us is None else span_us / 1e3)
