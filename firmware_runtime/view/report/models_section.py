"""The models: a table of what became of their activations, and charts of each."""

from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.figures import ModelFigures
from firmware_runtime.statistics.histogram import Distribution
from firmware_runtime.statistics.number_formats import NOTHING, duration_us, instant, rate, share
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view.markup import element, table
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
