"""What was found, as plots: recorded and replayed of the outputs that differ most."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element, tostring

from firmware_runtime.recording.what_if.what_if import WhatIf
from firmware_runtime.recording.what_if.what_if_text import number
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.view.line_plot import HEIGHT, WIDTH, Curve, LinePlot
from firmware_runtime.view.markup import element, table
from firmware_runtime.view.report.report import page_of, section

PLOTS: Final = 6
ENDINGS: Final = (".svg", ".html")


def write_plots(found: WhatIf, changed: str, path: Path) -> None:
    """Write the file. Raises ConfigError if it cannot be written."""
    plots = [_plot(found, name) for name in found.curves]
    title = f"{found.run}: {changed}"
    text = _stacked(plots, title) if path.suffix == ".svg" else _page(found, plots, title)
    keep_output(path, text.encode())


def _plot(found: WhatIf, name: str) -> LinePlot:
    curves = found.curves[name]
    drawn = (Curve("recorded", curves.recorded), Curve("replayed", curves.replayed))
    return LinePlot(name, "s", name, drawn, is_nested=True)


def _stacked(plots: list[LinePlot], title: str) -> str:
    """One picture with all of them, one below the other; with none, its title."""
    height = max(1, len(plots)) * HEIGHT
    inner = []
    for place, plot in enumerate(plots):
        each = plot.svg()
        each.set("y", f"{place * HEIGHT:g}")
        each.set("width", f"{WIDTH:g}")
        each.set("height", f"{HEIGHT:g}")
        each.attrib.pop("style", None)  # how large a page shows it
        inner.append(each)
    empty = element("text", f"{title}: no number differs", x=16, y=HEIGHT / 2)
    picture = element(
        "svg",
        element("title", title),
        *(inner or [empty]),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {WIDTH:g} {height:g}",
        width=f"{WIDTH:g}",
        height=f"{height:g}",
    )
    return tostring(picture, encoding="unicode") + "\n"


def _page(found: WhatIf, plots: list[LinePlot], title: str) -> str:
    return page_of(title, _sections(found, plots, title))


def _sections(found: WhatIf, plots: list[LinePlot], title: str) -> Iterator[Element]:
    said = "Open loop: what entered is what was recorded, so its own effect is not in it."
    yield element("header", element("h1", title), element("p", said, class_="quiet"))
    figures = (element("figure", element("figcaption", each.title), each.svg()) for each in plots)
    yield section("Outputs that differ most", *figures)
    heads = ("output", "differ", "of", "max", "rms", "first, s")
    rows = [
        (
            name,
            str(each.count + each.recorded_only + each.replayed_only),
            str(each.of),
            number(each.max),
            number(each.rms),
            number(each.first_s),
        )
        for name, each in found.outputs.items()
    ]
    yield section("All that differ", table("Differences", heads, rows))
    if found.structure:
        counts = [(what, str(count)) for what, count in found.structure.items()]
        yield section("Not a matter of values", table("Counted", ("what", "count"), counts))
