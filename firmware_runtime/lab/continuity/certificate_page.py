"""The certificate as a self-contained page: what differs first, then the stages side by side."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element

from firmware_runtime.board.roles import ROBOT
from firmware_runtime.devs.time import format_time
from firmware_runtime.lab.continuity.certificate import CLAIM, Certificate
from firmware_runtime.lab.continuity.compared_signals import (
    Points,
    Signals,
    commands,
    shown,
    signals_of,
)
from firmware_runtime.lab.continuity.stage_run import StageRun
from firmware_runtime.recording.replay.difference import Difference
from firmware_runtime.statistics.number_formats import milliseconds
from firmware_runtime.view.line_plot import Curve, LinePlot, on_common_axes
from firmware_runtime.view.markup import element, table
from firmware_runtime.view.report.report import page_of, section

_SIDE_BY_SIDE = (
    "display:grid;gap:1rem;grid-template-columns:repeat(auto-fit,minmax(min(24rem,100%),1fr))"
)
_WIDTH, _HEIGHT = 460.0, 250.0


def certificate_page(certificate: Certificate) -> str:
    """The page's text."""
    return page_of(_title(certificate), _sections(certificate))


def _title(certificate: Certificate) -> str:
    return f"{certificate.plan.board.name}: each stage and its replay"


def _sections(certificate: Certificate) -> Iterator[Element]:
    runs = [each for each in certificate.runs if each.has_run]
    yield _opening(certificate)
    yield section("Values that left the models", _events(certificate))
    differing = [(each, first) for each in runs if (first := each.first_difference) is not None]
    if differing:
        yield section("First differences", *(_difference(*each) for each in differing))
    yield from _side_by_side(runs, certificate)
    yield section("Code and settings", *_conditions(certificate))


def _opening(certificate: Certificate) -> Element:
    stages = ", ".join(each.stage for each in certificate.runs if each.has_run) or "no stage"
    if certificate.is_identical:
        css, sentence = "verdict good", f"{CLAIM[0].upper()}{CLAIM[1:]}: {stages}."
    else:
        css, sentence = "verdict bad", f"Not shown that {CLAIM}: {stages}."
    return element(
        "header",
        element("h1", _title(certificate)),
        element("p", element("strong", certificate.verdict, class_=css), sentence),
        element(
            "p",
            "What entered a stage's processes at their edges entered the same drivers and models "
            "again in virtual time; all that left them was compared, floats to the bit. Stages "
            "were not compared with one another: other samples enter in each.",
        ),
    )


def _events(certificate: Certificate) -> Element:
    head = (
        "stage",
        "end",
        "how it ended",
        "own values",
        "compared",
        "differ",
        "age p50, p99 of what came in",
    )
    rows = (row for each in certificate.runs for row in _event_rows(each))
    return table("Each stage and its replay", head, rows, "words")


def _event_rows(run: StageRun) -> Iterator[tuple[str, ...]]:
    if not run.has_run:
        yield (run.stage, "", f"not run: {run.why_not}", "", "", "", "")
        return
    if run.failed is not None or not run.ends:
        yield (run.stage, "", run.failed or "", "", "", "", "")
    for role, end in run.ends.items():
        ended = end.fault or run.document.get("ended", {}).get("reason", "")
        verdict = end.verdict
        counts = (verdict.values, verdict.compared, verdict.differences)
        yield (run.stage, role, ended, *(f"{count:,}" for count in counts), _age(run, role))


def _age(run: StageRun, role: str) -> str:
    link = run.document.get("link") or {}
    age = link.get("out" if role == ROBOT else "back", {}).get("age_us")
    return "" if age is None else f"{milliseconds(age['p50'])}, {milliseconds(age['p99'])}"


def _difference(run: StageRun, first: Difference) -> Element:
    said = first.as_json()
    rows = [(name, json.dumps(said[name])) for name in ("what", "recorded", "replayed")]
    caption = f"{run.stage}, {first.where} at {format_time(first.at)}"
    return table(caption, ("what", "value"), rows, "words")


# The stages side by side ------------------------------------------------------------------------


def _side_by_side(runs: Sequence[StageRun], certificate: Certificate) -> Iterator[Element]:
    """A section for each quantity, a plot a stage in it: one axis of time, one of the quantity."""
    if not any(each.ends for each in runs):
        return
    signals = signals_of(certificate.plan.board)
    rows = {
        signals.shown or "Shown value": {each.stage: _shown(each, signals) for each in runs},
        "Commands": {each.stage: _commands(each, signals) for each in runs},
    }
    for title, curves in rows.items():
        drawn = on_common_axes(
            {
                stage: plot
                for stage, each in curves.items()
                if (plot := _plot(stage, title, each, certificate.plan.for_s)) is not None
            }
        )
        figures = (_figure(stage, drawn.get(stage)) for stage in curves)
        yield section(title, element("div", *figures, style=_SIDE_BY_SIDE))


def _plot(stage: str, title: str, curves: Mapping[str, Points], for_s: float) -> LinePlot | None:
    """What is drawn of a quantity in a stage, while its controller ran; None for nothing."""
    drawn = [
        Curve(name, seen)
        for name, points in curves.items()
        if (seen := [point for point in points if point[0] <= for_s])
    ]
    return LinePlot(stage, "s", title, drawn, width=_WIDTH, height=_HEIGHT) if drawn else None


def _figure(stage: str, plot: LinePlot | None) -> Element:
    drawn = element("p", "none", class_="quiet") if plot is None else replace(plot, up="").svg()
    return element("figure", element("figcaption", stage), drawn)


def _shown(run: StageRun, signals: Signals) -> dict[str, Points]:
    """The board's own value, from the end that has it, since the controller began."""
    for role, end in run.ends.items():
        since = run.controller_began_s if role == ROBOT else 0.0
        if points := shown(end.recording, signals.shown):
            later = [(at - since, value) for at, value in points if at >= since]
            return {signals.shown or "": later}
    return {}


def _commands(run: StageRun, signals: Signals) -> dict[str, Points]:
    """Of the end that computes, which is the first."""
    first = next(iter(run.ends.values()), None)
    return {} if first is None else commands(first.recording, signals.commands)


def _conditions(certificate: Certificate) -> Iterator[Element]:
    said = certificate.as_json()
    settings: Mapping[str, Any] = said["settings"]
    yield table(
        "What ran",
        ("what", "value"),
        [
            ("code the same in all runs and replays", _yes(said["same_code"])),
            ("SHA-256 of it", str(said["code_sha256"])),
            ("settings the same in all runs", _yes(said["same_settings"])),
            ("settings", settings["source"]),
            ("overrides", ", ".join(settings["overrides"]) or "none"),
            ("SHA-256 of the settings", settings["sha256"]),
            *((name, str(each)) for name, each in (said["versions"] or {}).items()),
        ],
        "words",
    )
    yield table(
        "SHA-256 of each module of its code", ("module", "SHA-256"), said["code"].items(), "words"
    )


def _yes(is_so: object) -> str:
    return "yes" if is_so else "no"
