"""The sections of a report that are tables and words: faults, deadlines, lines, conditions."""

from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

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
from firmware_runtime.view.markup import element, facts, table
from firmware_runtime.view.report.distribution import Mark, distribution

_COUNTS = ("scheduled", "run", "overruns", "skipped", "coalesced")


def models_section(statistics: Statistics, models: Mapping[str, ModelFigures]) -> list[Element]:
    """The tables, then lateness and own time of each model."""
    if not models:
        return [element("p", "This model has no atomic model.")]
    return [
        _activations(models, is_virtual=statistics.is_virtual),
        _times(models),
        element("div", *_charts(statistics, models), class_="pairs"),
    ]


def tolerance_ns(model: ModelFigures) -> int:
    """The lateness from which on an activation of a model is late."""
    return round(model.tolerance_us * 1000)


def _activations(models: Mapping[str, ModelFigures], *, is_virtual: bool) -> Element:
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


def _times(models: Mapping[str, ModelFigures]) -> Element:
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


def _charts(statistics: Statistics, models: Mapping[str, ModelFigures]) -> Iterator[Element]:
    """Lateness is left out where one model only was activated: it is the page's first chart."""
    activated = sum(model.run > 0 for model in models.values())
    for index, (path, model) in enumerate(models.items()):
        if model.run > 0 and activated > 1 and not statistics.is_virtual:
            lateness = statistics.lateness_of(index)
            limit = Mark("tolerance", tolerance_ns(model), "limit")
            yield distribution(f"lateness-{index}", f"{path}: lateness", lateness, [limit])
        own_time = statistics.own_time_of(index)
        if own_time.samples == 0:
            continue
        yield distribution(f"own-time-{index}", f"{path}: own time", own_time)


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


def faults_section(faults: Mapping[str, Mapping[str, FaultFigures]]) -> Element:
    """A row for each kind of fault of each model."""
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
    none = "No model reported a fault."
    return table("Faults that models reported", _FAULT_HEAD, rows, otherwise=none)


def deadlines_table(deadlines: Mapping[str, DeadlineRow]) -> Element:
    """Samples on each path, and those that took effect too late."""
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
    none = "The board puts no deadline on a path."
    return table("Deadlines on a path", head, rows, otherwise=none)


def buses_table(buses: Mapping[str, BusFigures]) -> Element:
    """Traffic of each bus."""
    counters = ("transactions", "bytes", "errors", "retries")
    rows = (
        [name, share(bus.utilisation), *(f"{getattr(bus, each):,}" for each in counters)]
        for name, bus in buses.items()
    )
    return table("Buses", ["bus", "busy", *counters], rows, otherwise="No bus was counted.")


def serial_table(ports: Mapping[str, SerialFigures]) -> Element | None:
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


def conditions_section(conditions: Conditions) -> list[Element]:
    """Return what was refused, what was requested, and everything else that is known."""
    return [
        *(_refusal(name, request) for name, request in conditions.refused.items()),
        _settings(conditions.settings),
        facts("Conditions", conditions.stated),
    ]


def _refusal(name: str, request: Request) -> Element:
    reason, _, needs = str(request.reason).partition(_NEEDS)
    return element(
        "p",
        element("strong", "Not granted: "),
        element("code", f"{name} = {plain(request.asked)}"),
        f". {reason}.",
        f" It takes {needs}." if needs else None,
        class_="refused",
    )


def _settings(settings: Settings) -> Element:
    return table(
        "What the board asks of the system",
        ["setting", "asked", "granted"],
        (
            [name, plain(each.asked), "yes" if each.granted else plain(each.reason)]
            for name, each in settings.items()
        ),
        css="words",
    )


def glossary(figures: Figures) -> Iterator[Element]:
    """The words, then where the page and its numbers come from."""
    pairs = (
        element("div", element("dt", word), element("dd", meaning))
        for word, meaning in _WORDS.items()
    )
    yield element("dl", *pairs, class_="glossary")
    made = f"firmware-runtime {version_of('firmware-runtime')}"
    ran = (figures.conditions.stated.get("versions") or {}).get("firmware-runtime")
    yield element(
        "p",
        f"Made by {made} from a copy of the run's statistics file (schema {SCHEMA})",
        f", which firmware-runtime {ran} had written" if ran else None,
        ". Making it changed nothing in that file; equal statistics make an equal page. ",
        "The page holds all it needs and asks nothing of any network.",
        class_="quiet",
    )
