"""The certificate as a self-contained page: what differs first, then the stages side by side."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element

from firmware_runtime.continuity.certificate import NOTHING, Certificate
from firmware_runtime.continuity.signals import Points, ages, commands, shown
from firmware_runtime.continuity.stage_run import StageRun
from firmware_runtime.devs.time import format_time
from firmware_runtime.experiments.line_plot import Curve, LinePlot, on_common_axes
from firmware_runtime.part_recording.comparison import Comparison
from firmware_runtime.statistics.page.markup import element, table
from firmware_runtime.statistics.page.page import page_of, section

_SIDE_BY_SIDE = (
    "display:grid;gap:1rem;grid-template-columns:repeat(auto-fit,minmax(min(24rem,100%),1fr))"
)
_WIDTH, _HEIGHT = 460.0, 250.0


def certificate_page(certificate: Certificate) -> str:
    """The page's text."""
    board = certificate.plan.board.name
    return page_of(f"{board}: one controller, every stage", _sections(certificate))


def _sections(certificate: Certificate) -> Iterator[Element]:
    runs = [each for each in certificate.runs if each.has_run]
    yield _opening(certificate)
    yield section("Output events", _events(certificate))
    differing = [each for each in runs if each.comparison is not None and each.comparison.first]
    if differing:
        yield section("First differences", *(_difference(each) for each in differing))
    yield from _side_by_side(runs, certificate.plan.for_s)
    yield section("What was compared", *_conditions(certificate))


def _opening(certificate: Certificate) -> Element:
    board = certificate.plan.board.name
    stages = ", ".join(each.stage for each in certificate.runs if each.has_run) or "no stage"
    if certificate.is_equal:
        css = "verdict good"
        sentence = f"The controller of {board} did the same in every stage run: {stages}."
    else:
        css = "verdict bad"
        sentence = f"That the controller of {board} does the same is not shown by: {stages}."
    return element(
        "header",
        element("h1", f"{board}: one controller, every stage"),
        element("p", element("strong", certificate.verdict, class_=css), sentence),
        element(
            "p",
            "What entered the controller in a stage entered a fresh one in virtual time, at the "
            "same instants and rounds; every output event was compared, floats to the bit.",
        ),
    )


def _events(certificate: Certificate) -> Element:
    head = ("stage", "how it ended", "entered", "left", "differ", "age p50, p99, max")
    return table("Each stage and its replay", head, map(_event_row, certificate.runs), "words")


def _event_row(run: StageRun) -> tuple[str, ...]:
    comparison, document = run.comparison or NOTHING, run.document
    if not run.has_run:
        return (run.stage, f"not run: {run.why_not}", "", "", "", "")
    fault = run.failed or comparison.fault
    ended = fault or document.get("ended", {}).get("reason", "")
    counts = (comparison.inputs, comparison.events, comparison.differences)
    return (run.stage, ended, *(f"{count:,}" for count in counts), _ages_said(run))


def _ages_said(run: StageRun) -> str:
    return "; ".join(
        f"{name} {', '.join(f'{each[key] / 1000:.2f}' for key in ('p50', 'p99', 'max'))} ms"
        for name, each in (run.ages_us or {}).items()
    )


def _difference(run: StageRun) -> Element:
    comparison = run.comparison
    assert isinstance(comparison, Comparison)  # noqa: S101 -- of stages that differ
    assert comparison.first is not None  # noqa: S101
    said = comparison.first.as_json(comparison.state)
    rows = [(name, json.dumps(said[name])) for name in ("port", "recorded", "replayed", "state")]
    caption = f"{run.stage}, at {format_time(comparison.first.at)}"
    return table(caption, ("what", "value"), rows, "words")


# The stages side by side ------------------------------------------------------------------------


def _side_by_side(runs: Sequence[StageRun], for_s: float) -> Iterator[Element]:
    """A section for each quantity, a plot a stage in it: one axis of time, one of the quantity."""
    rows = {
        _shown_name(runs) or "Shown value": (_shown, "not recorded here"),
        "Commands": (_commands, "none left"),
        "Age of samples, ms": (_ages, "no link: a sample enters at the instant it was taken"),
    }
    drawn = on_common_axes(
        {
            f"{title} {run.stage}": plot
            for title, (curves, _) in rows.items()
            for run in runs
            if (plot := _plot(run, title, curves(run), for_s)) is not None
        }
    )
    for title, (_, without) in rows.items():
        figures = (_figure(run, drawn.get(f"{title} {run.stage}"), without) for run in runs)
        yield section(title, element("div", *figures, style=_SIDE_BY_SIDE))


def _plot(run: StageRun, title: str, curves: Mapping[str, Points], for_s: float) -> LinePlot | None:
    """What is drawn of a quantity in a stage, while its controller ran; None for nothing."""
    drawn = [
        Curve(name, seen)
        for name, points in curves.items()
        if (seen := [point for point in points if point[0] <= for_s])
    ]
    return LinePlot(run.stage, "s", title, drawn, width=_WIDTH, height=_HEIGHT) if drawn else None


def _figure(run: StageRun, plot: LinePlot | None, without: str) -> Element:
    shown = element("p", without, class_="quiet") if plot is None else replace(plot, up="").svg()
    return element("figure", element("figcaption", run.stage), shown)


def _shown(run: StageRun) -> dict[str, Points]:
    """The board's own value, from the end that shows it, since the controller began."""
    for recording, since in ((run.robot, run.controller_began_s), (run.recording, 0.0)):
        if recording is not None and (points := shown(recording)):
            later = [(at - since, value) for at, value in points if at >= since]
            return {recording.header.shown or "": later}
    return {}


def _commands(run: StageRun) -> dict[str, Points]:
    return {} if run.recording is None else commands(run.recording)


def _ages(run: StageRun) -> dict[str, Points]:
    return {} if run.recording is None else ages(run.recording)


def _shown_name(runs: Sequence[StageRun]) -> str | None:
    return next((name for each in runs for name in _shown(each)), None)


def _conditions(certificate: Certificate) -> Iterator[Element]:
    said = certificate.as_json()
    settings: Mapping[str, Any] = said["settings"]
    yield table(
        "Code and settings",
        ("what", "value"),
        [
            ("components of the controller", ", ".join(said["components"] or ())),
            ("SHA-256 of its code", str(said["code_sha256"])),
            ("settings", settings["source"]),
            ("overrides", ", ".join(settings["overrides"]) or "none"),
            ("SHA-256 of the settings", settings["sha256"]),
            *((name, str(each)) for name, each in (said["versions"] or {}).items()),
        ],
        "words",
    )
    modules = (said["code"] or {}).items()
    yield table("SHA-256 of each module of its code", ("module", "SHA-256"), modules, "words")
