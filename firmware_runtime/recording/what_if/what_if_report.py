"""Differences that a change would make, for people: lines for a terminal, and plots."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

from firmware_runtime.recording.recorded_board import versions_said
from firmware_runtime.recording.replay.difference import in_lines
from firmware_runtime.recording.replay.outputs import OutputDifference
from firmware_runtime.recording.what_if.what_if import WhatIf
from firmware_runtime.statistics.run_text import aligned
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.view.canvas import file_text
from firmware_runtime.view.line_plot import HEIGHT, WIDTH, Curve, LinePlot, figure_of
from firmware_runtime.view.markup import element, opening, page_of, section, table

PLOTS: Final = 6
ENDINGS: Final = (".svg", ".html")
SHOWN: Final = 12
_HEADS: Final = ("output", "differ", "of", "max", "rms", "first, s")


def what_if_text(found: WhatIf, changed: str) -> Iterator[str]:
    """All lines for a terminal; `changed` says what was."""
    yield f"what if: {changed}"
    for fault in found.faults:
        yield f"  not whole: {fault}"
    if found.failure is not None:
        yield f"  the changed code failed: {found.failure}"
    if not found.outputs and not found.structure:
        yield f"  no output of {found.run} would have been another: {found.events} values"
    elif found.outputs:
        outputs = f"{len(found.outputs)} outputs and fields of {found.run} differ"
        yield f"  {outputs}, open loop: what entered is what was recorded"
        shown = [_row(*each) for each in islice(found.outputs.items(), SHOWN)]
        yield from (f"  {line}" for line in aligned([_HEADS, *shown]))
        if len(found.outputs) > SHOWN:
            yield f"  and {len(found.outputs) - SHOWN} more (--json has them all)"
    yield from (f"  not compared: {each}" for each in found.not_compared)
    for what, count in found.structure.items():
        yield f"  {count} {what}"
    if found.first_difference is not None:
        first, *values = in_lines(found.first_difference)
        yield from (f"  first {first}", *(f"  {each}" for each in values))
    yield f"  {found.steps} steps, {found.duration_s:.3f} s of the run"
    if found.began_earlier is not None:
        yield f"  {found.began_earlier}"
    if found.versions_changed:
        yield f"  versions that are others than in the run: {versions_said(found.versions_changed)}"


def _row(name: str, found: OutputDifference) -> tuple[str, ...]:
    missing = found.recorded_only + found.replayed_only
    return (
        name,
        str(found.count + missing),
        str(found.of + missing),
        number(found.max),
        number(found.rms),
        "-" if found.first_s is None else f"{found.first_s:.3f}",
    )


def number(value: float | None) -> str:
    """A figure, four digits of it."""
    return "-" if value is None else f"{value:.4g}"


def write_plots(found: WhatIf, changed: str, path: Path) -> None:
    """Write plots of the outputs that differ most. Raises ConfigError if that cannot be done."""
    plots = [_plot(found, name) for name in found.curves]
    title = f"{found.run}: {changed}"
    if path.suffix == ".svg":
        text = file_text(_stacked(plots, title))
    else:
        text = page_of(title, _sections(found, plots, title))
    keep_output(path, text.encode())


def _plot(found: WhatIf, name: str) -> LinePlot:
    curves = found.curves[name]
    drawn = (Curve("recorded", curves.recorded), Curve("replayed", curves.replayed))
    return LinePlot(name, "s", name, drawn, is_nested=True)


def _stacked(plots: list[LinePlot], title: str) -> Element:
    """One picture with all of them, one below the other; with none, its title."""
    height = max(1, len(plots)) * HEIGHT
    inner = [plot.svg() for plot in plots]
    for place, each in enumerate(inner):
        each.attrib.pop("style", None)  # how large a page shows it
        each.attrib |= {"y": f"{place * HEIGHT:g}", "width": f"{WIDTH:g}", "height": f"{HEIGHT:g}"}
    empty = element("text", f"{title}: no number differs", x=16, y=HEIGHT / 2)
    return element(
        "svg",
        element("title", title),
        *(inner or [empty]),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {WIDTH:g} {height:g}",
        width=WIDTH,
        height=height,
    )


def _sections(found: WhatIf, plots: list[LinePlot], title: str) -> Iterator[Element]:
    said = "Open loop: what entered is what was recorded, so its own effect is not in it."
    yield opening(title, element("p", said, class_="quiet"))
    yield section("Outputs that differ most", *map(figure_of, plots))
    rows = [_row(*each) for each in found.outputs.items()]
    yield section("All that differ", table("Differences", _HEADS, rows))
    if found.structure:
        counts = [(what, str(count)) for what, count in found.structure.items()]
        yield section("Not a matter of values", table("Counted", ("what", "count"), counts))
