"""The whole report: sections in the order of the reader's questions.

Equal statistics make equal bytes: nothing of the page comes from the clock.
"""

from collections.abc import Iterator

from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.number_formats import NOTHING, duration_us, share
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view import parts
from firmware_runtime.view.parts import Level, Page, Part, Section, Text, section
from firmware_runtime.view.report.distribution import distribution
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


def report(statistics: Statistics, headline: str) -> Page:
    """The page; `headline` is the line in which `stats` sums the run up."""
    figures = statistics.figures()
    board = figures.conditions.text("board") or "a run"
    return Page(
        title=f"{board}: timing report",
        opening=[
            verdict(figures),
            Text(text=headline, look="headline"),
            parts.Figures(items=list(_figures(statistics, figures).items())),
        ],
        parts=_sections(statistics, figures),
    )


def _sections(statistics: Statistics, figures: Figures) -> list[Section]:
    return [
        section("Lateness", _lateness(statistics, figures)),
        section("Over time", *_over_time(statistics, figures)),
        section("Models", *models_section(statistics, figures.models)),
        section("Steps", _steps(statistics)),
        section("Faults", faults_section(figures.faults)),
        section("Worst activations", *worst_activations(figures.worst)),
        section(
            "Deadlines and buses",
            deadlines_table(figures.deadlines),
            buses_table(figures.bus),
            serial_table(figures.serial or {}),
        ),
        section("Conditions", *conditions_section(figures.conditions)),
        section("What the words mean, and how this page was made", *glossary(figures)),
    ]


def _figures(statistics: Statistics, figures: Figures) -> dict[str, str]:
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
    return shown | {f"bus {name}": share(bus.utilisation) for name, bus in figures.bus.items()}


def _lateness(statistics: Statistics, figures: Figures) -> Part:
    limits = sorted({tolerance_ns(model) for model in figures.models.values()})
    names = ["tolerance"] if len(limits) == 1 else ["least tolerance", "greatest tolerance"]
    ends = dict.fromkeys((limits[0], limits[-1])) if limits else {}
    levels = [Level(ns, name, is_limit=True) for name, ns in zip(names, ends, strict=False)]
    title = "Lateness of all activations: how many began how long after their deadline"
    return distribution(title, statistics.lateness(), levels)


def _over_time(statistics: Statistics, figures: Figures) -> Iterator[Part]:
    run = stretches(statistics.timeline, statistics.cells[ELAPSED])
    limit = min(map(tolerance_ns, figures.models.values()), default=None)
    shown: list[Part] = list(lateness_over_time(run, limit))
    if (load := load_over_time(run)) is not None:
        shown.append(load)
    if not shown:
        shown.append(Text(text="There is nothing to draw: no lateness, no load has been measured."))
    yield from shown


def _steps(statistics: Statistics) -> Part:
    title = "Whole steps: how many took how long, all models and their buses together"
    return distribution(title, statistics.step_times())
