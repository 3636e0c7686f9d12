"""The whole page: sections in the order of the reader's questions.

Equal statistics make equal bytes: nothing of the page comes from the clock, and the page asks
nothing of the network. Its content security policy holds it to that.
"""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.number_formats import NOTHING, duration_us, share
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view.markup import element, opening, page_of, section, verdict_line
from firmware_runtime.view.report.distribution import Mark, distribution
from firmware_runtime.view.report.over_time import lateness_over_time, load_over_time, stretches
from firmware_runtime.view.report.sections import (
    buses_table,
    conditions_section,
    deadlines_table,
    faults_section,
    glossary,
    models_section,
    serial_table,
    tolerance_ns,
)
from firmware_runtime.view.report.verdict import verdict
from firmware_runtime.view.report.worst import worst_activations


def page(statistics: Statistics, headline: str) -> str:
    """The page's text; `headline` is the line in which `stats` sums the run up."""
    figures = statistics.figures()
    board = figures.conditions.text("board") or "a run"
    return page_of(f"{board}: timing report", _sections(statistics, figures, board, headline))


def _sections(
    statistics: Statistics, figures: Figures, board: str, headline: str
) -> Iterator[Element]:
    yield _opening(statistics, figures, board, headline)
    yield section("Lateness", *_lateness(statistics, figures))
    yield section("Over time", *_over_time(statistics, figures))
    yield section("Models", *models_section(statistics, figures.models))
    yield section("Steps", *_steps(statistics))
    yield section("Faults", faults_section(figures.faults))
    yield section("Worst activations", *worst_activations(figures.worst))
    yield section(
        "Deadlines and buses",
        deadlines_table(figures.deadlines),
        buses_table(figures.bus),
        serial_table(figures.serial or {}),
    )
    yield section("Conditions", *conditions_section(figures.conditions))
    yield section("What the words mean, and how this page was made", *glossary(figures))


def _opening(statistics: Statistics, figures: Figures, board: str, headline: str) -> Element:
    judged = verdict(figures)
    return opening(
        f"{board}: timing report",
        verdict_line(judged.word, judged.css, " ".join(judged.sentences)),
        element("p", element("code", headline), class_="headline"),
        element("dl", *_figures(statistics, figures), class_="figures"),
    )


def _figures(statistics: Statistics, figures: Figures) -> Iterator[Element]:
    """The numbers that are looked for first."""
    run, late = figures.conditions.run, figures.lateness_us
    shown = {
        "activations run": f"{figures.run:,} of {figures.scheduled:,}",
        "late": NOTHING if statistics.is_virtual else f"{figures.overruns:,}",
        "skipped": f"{figures.skipped:,}",
        "lateness p50": duration_us(late.p50),
        "lateness p99": duration_us(late.p99),
        "lateness max": duration_us(late.max),
        "whole step p99": duration_us(figures.step_us.p99),
    }
    if run.cpu_s is not None and run.elapsed_s > 0:
        shown["processor"] = share(run.cpu_s / run.elapsed_s)
    shown |= {f"bus {name}": share(bus.utilisation) for name, bus in figures.bus.items()}
    for name, figure in shown.items():
        yield element("div", element("dt", name), element("dd", figure))


def _lateness(statistics: Statistics, figures: Figures) -> Iterator[Element]:
    limits = sorted({tolerance_ns(model) for model in figures.models.values()})
    names = ["tolerance"] if len(limits) == 1 else ["least tolerance", "greatest tolerance"]
    ends = dict.fromkeys((limits[0], limits[-1])) if limits else {}
    marks = [Mark(name, ns, "limit") for name, ns in zip(names, ends, strict=False)]
    caption = "Lateness of all activations: how many began how long after their deadline"
    yield distribution("lateness", caption, statistics.lateness(), marks)


def _over_time(statistics: Statistics, figures: Figures) -> Iterator[Element]:
    run = stretches(statistics.timeline, statistics.cells[ELAPSED])
    limit = min(map(tolerance_ns, figures.models.values()), default=None)
    charts = lateness_over_time(run, limit), load_over_time(run)
    drawn = [chart for chart in charts if chart is not None]
    yield from drawn
    if not drawn:
        yield element("p", "There is nothing to draw: no lateness, no load has been measured.")


def _steps(statistics: Statistics) -> Iterator[Element]:
    caption = "Whole steps: how many took how long, all models and their buses together"
    yield distribution("steps", caption, statistics.step_times())
