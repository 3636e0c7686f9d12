"""What an experiment leaves: data (CSV), figures (JSON), plots (SVG) and a page (HTML)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import msgspec

from firmware_runtime.errors import ConfigError
from firmware_runtime.experiments.conditions import conditions
from firmware_runtime.experiments.line_plot import LinePlot
from firmware_runtime.statistics.page.markup import chart, element, table
from firmware_runtime.statistics.page.page import page_of, section


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """One experiment with one board, in its stages."""

    name: str
    title: str
    board: str
    published: Sequence[str]
    plots: Mapping[str, LinePlot]
    """By the name of its file."""
    csv: Sequence[str]
    numbers: Element
    figures: Mapping[Any, Any]
    """By stage."""
    text: Sequence[str]
    """For a terminal."""


def write_results(results: Results, folder: Path) -> list[Path]:
    """Write every file; return their paths. Raises ConfigError for a folder that takes none."""
    measured = conditions()
    figures = {
        "experiment": results.name,
        "board": results.board,
        "stages": {str(stage): each for stage, each in results.figures.items()},
        "published": list(results.published),
        "conditions": measured,
    }
    texts = {
        f"{results.name}.csv": "".join(f"{line}\n" for line in results.csv),
        f"{results.name}.json": msgspec.json.format(msgspec.json.encode(figures)).decode() + "\n",
        **{f"{name}.svg": plot.text() for name, plot in results.plots.items()},
        f"{results.name}.html": _page(results, measured),
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (folder / name).write_text(text)
    except OSError as error:
        fault = f"-o: {folder}: {error.strerror}; expected a folder that can be written"
        raise ConfigError("experiment", [fault]) from error
    return [folder / name for name in texts]


def _page(results: Results, measured: Mapping[str, str]) -> str:
    """The page's text: plots and figures, what was published, the conditions."""
    title = f"{results.board}: {results.title}"
    plots = (chart(plot.svg(), plot.title, None) for plot in results.plots.values())
    sentences = [element("li", sentence) for sentence in results.published]
    published = element("ul", *sentences) if sentences else element("p", "Nothing is known.")
    return page_of(
        title,
        (
            element("header", element("h1", title)),
            section("Measured", *plots, results.numbers),
            section("Published", published),
            section(
                "Conditions", table("Of this run", ("what", "value"), measured.items(), "words")
            ),
        ),
    )
