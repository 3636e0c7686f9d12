"""The sections of a report that are tables and words: faults, deadlines, lines, conditions."""

from collections.abc import Iterator, Mapping

from firmware_runtime.statistics.figures import (
    SCHEMA,
    BusFigures,
    FaultFigures,
    Figures,
    ModelFigures,
    SerialFigures,
)
from firmware_runtime.statistics.file_header import Conditions, Request, Settings
from firmware_runtime.statistics.histogram import Distribution
from firmware_runtime.statistics.number_formats import (
    NOTHING,
    duration_us,
    instant,
    instant_s,
    plain,
    rate,
    share,
)
from firmware_runtime.statistics.rows import DeadlineRow
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.packages import version_of
from firmware_runtime.view.parts import Beside, Glossary, Level, Part, Table, Text, facts, table
from firmware_runtime.view.report.distribution import distribution

_COUNTS = ("scheduled", "run", "overruns", "skipped", "coalesced")


def models_section(statistics: Statistics, models: Mapping[str, ModelFigures]) -> list[Part]:
    """The tables, then lateness and own time of each model."""
    if not models:
        return [Text(text="This model has no atomic model.")]
    return [
        _activations(models, is_virtual=statistics.is_virtual),
        _times(models),
        Beside(parts=list(_distributions(statistics, models))),
    ]


def tolerance_ns(model: ModelFigures) -> int:
    """The lateness from which on an activation of a model is late."""
    return round(model.tolerance_us * 1000)


def _activations(models: Mapping[str, ModelFigures], *, is_virtual: bool) -> Table:
    """In virtual time nothing can be late, so no number says how much was."""
    head = ["model", "rate", "policy", "tolerance"]
    head += ["scheduled", "run", "late", "skipped", "coalesced", "last late"]
    rows = (
        [
            path,
            rate(model.period_us),
            model.policy or NOTHING,
            duration_us(model.tolerance_us),
            *(
                NOTHING if is_virtual and key == "overruns" else f"{getattr(model, key):,}"
                for key in _COUNTS
            ),
            instant(model.last_late_t_ns),
        ]
        for path, model in models.items()
    )
    return table("What became of the activations of each model", head, rows)


def _times(models: Mapping[str, ModelFigures]) -> Table:
    head = ["model", "lateness p50", "p99", "p99.9", "max"]
    head += ["own time p50", "p99", "p99.9", "max", "load"]
    rows = (
        [
            path,
            *_percentiles(model.lateness_us),
            *_percentiles(model.step_us),
            share(model.load),
        ]
        for path, model in models.items()
    )
    return table("How late they began, and what the models' own functions took", head, rows)


def _percentiles(time: Distribution) -> Iterator[str]:
    return map(duration_us, (time.p50, time.p99, time.p999, time.max))


def _distributions(statistics: Statistics, models: Mapping[str, ModelFigures]) -> Iterator[Part]:
    """Lateness is left out where one model only was activated: it is the page's first one."""
    activated = sum(model.run > 0 for model in models.values())
    for index, (path, model) in enumerate(models.items()):
        if model.run > 0 and activated > 1 and not statistics.is_virtual:
            lateness = statistics.lateness_of(index)
            limit = Level(tolerance_ns(model), "tolerance", is_limit=True)
            yield distribution(f"{path}: lateness", lateness, [limit], is_small=True)
        own_time = statistics.own_time_of(index)
        if own_time.samples > 0:
            yield distribution(f"{path}: own time", own_time, is_small=True)


_FAULT_HEAD = ("model", "kind", "times", "first", "last", "in words, the last time")
_NEEDS = "; needs "
"""The words in a reason that introduce its fix."""
_WORDS = {
    "lateness": "from an activation's deadline to the start of its output function",
    "late": "an activation that ran, but began later than its model tolerates",
    "skipped": "due, and dropped: by policy, or because the run ended before its turn",
    "coalesced": "due by the clock, but an earlier event made the model plan again",
    "own time": "what a model's own functions took in a step; the steps' own times add up",
    "waking": "from the deadline, or the end of the step before, to the start of this step",
    "steps before": "from the deadline to the end of the step before: our own steps took too long",
    "bus time": "time on the wire, computed from bits and bus speed; doubles answer sooner",
    "p99": "99 % of all samples did not take longer; never too low, at most 3.1 % too high",
}


def faults_section(faults: Mapping[str, Mapping[str, FaultFigures]]) -> Part:
    """A row for each kind of fault of each model."""
    if not faults:
        return Text(text="No model reported a fault.")
    rows = (
        [
            path,
            kind,
            f"{counted.count:,}",
            instant_s(counted.first_s),
            instant_s(counted.last_s),
            counted.last,
        ]
        for path, kinds in faults.items()
        for kind, counted in kinds.items()
    )
    return table("Faults that models reported", _FAULT_HEAD, rows, is_words=True)


def deadlines_table(deadlines: Mapping[str, DeadlineRow]) -> Part:
    """Samples on each path, and those that took effect too late."""
    if not deadlines:
        return Text(text="The board puts no deadline on a path.")
    rows = (
        [
            path,
            f"{counted.samples:,}",
            f"{counted.answers:,}",
            f"{counted.misses:,}" if counted.answers > 0 else "not enabled",
        ]
        for path, counted in deadlines.items()
    )
    head = ["path", "samples", "answers", "missed"]
    return table("Deadlines on a path", head, rows)


def buses_table(buses: Mapping[str, BusFigures]) -> Part:
    """Traffic of each bus."""
    if not buses:
        return Text(text="No bus was counted.")
    counters = ("transactions", "bytes", "errors", "retries")
    rows = (
        [name, share(bus.utilisation), *(f"{getattr(bus, each):,}" for each in counters)]
        for name, bus in buses.items()
    )
    return table("Buses", ["bus", "busy", *counters], rows)


def serial_table(ports: Mapping[str, SerialFigures]) -> Table | None:
    """Traffic of each serial port, where there is one."""
    if not ports:
        return None
    counters = ("writes", "bytes_written", "bytes_read", "errors")
    head = ["port", "writing", "reading", *(each.replace("_", " ") for each in counters)]
    rows = (
        [
            name,
            share(port.writing),
            share(port.reading),
            *(f"{getattr(port, each):,}" for each in counters),
        ]
        for name, port in ports.items()
    )
    return table("Serial ports", head, rows)


def conditions_section(conditions: Conditions) -> list[Part]:
    """Return what was refused, what was requested, and everything else that is known."""
    return [
        *(_refusal(name, request) for name, request in conditions.refused.items()),
        _settings(conditions.settings),
        facts("Conditions", conditions.stated),
    ]


def _refusal(name: str, request: Request) -> Text:
    reason, _, needs = str(request.reason).partition(_NEEDS)
    takes = f" It takes {needs}." if needs else ""
    said = f"Not granted: {name} = {plain(request.asked)}. {reason}.{takes}"
    return Text(text=said, look="warning")


def _settings(settings: Settings) -> Table:
    rows = (
        [name, plain(each.asked), "yes" if each.granted else plain(each.reason)]
        for name, each in settings.items()
    )
    head = ["setting", "asked", "granted"]
    return table("What the board asks of the system", head, rows, is_words=True)


def glossary(figures: Figures) -> list[Part]:
    """The words, then where the page and its numbers come from."""
    made = f"firmware-runtime {version_of('firmware-runtime')}"
    ran = (figures.conditions.stated.get("versions") or {}).get("firmware-runtime")
    writer = f", which firmware-runtime {ran} had written" if ran else ""
    said = (
        f"Made by {made} from a copy of the run's statistics file (schema {SCHEMA}){writer}. "
        "Making it changed nothing in that file; equal statistics make an equal page. "
        "The page holds all it needs and asks nothing of any network."
    )
    return [Glossary(items=list(_WORDS.items())), Text(text=said, look="quiet")]
