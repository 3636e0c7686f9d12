"""The index of a board's experiments: failures first, then each with its plot and its numbers."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

from firmware_runtime.board.experiments import Experiment
from firmware_runtime.lab.experiments.experiment_page import drawn
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.quantities import in_words, with_unit
from firmware_runtime.lab.experiments.run_conditions import conditions
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.view.line_plot import LinePlot
from firmware_runtime.view.markup import element, table
from firmware_runtime.view.report.report import page_of, section

_CARDS = (
    "display:grid;gap:1.5rem 2rem;"
    "grid-template-columns:repeat(auto-fit,minmax(min(24rem,100%),1fr))"
)

_WIDTH, _HEIGHT = 600.0, 290.0
_LINK = "color:var(--blue)"
_SMALL = "font-size:.85rem;margin:.3rem 0"
_SENTENCES = 3


@dataclass(frozen=True, slots=True)
class Line:
    """One experiment: what it found, why it failed, or why it was not run."""

    name: str
    experiment: Experiment
    findings: Findings | None
    fault: str | None
    not_run: str | None


def index_page(board: str, lines: Sequence[Line]) -> str:
    """The page's text."""
    title = f"{board}: experiments"
    return page_of(title, _sections(title, lines))


def _sections(title: str, lines: Sequence[Line]) -> Iterator[Element]:
    yield element("header", element("h1", title), *_opening(lines))
    cards = (_card(line, line.findings) for line in lines if line.findings is not None)
    yield section("Experiments", element("div", *cards, style=_CARDS))
    yield section("Beside the paper", _numbers(lines))
    yield section("Conditions", table("Of this machine", ("what", "value"), conditions().items()))


def _opening(lines: Sequence[Line]) -> Iterator[Element]:
    """How many went well; what failed or was not run is said first."""
    failed = [(line.name, line.fault) for line in lines if line.fault is not None]
    not_run = [(line.name, line.not_run) for line in lines if line.not_run is not None]
    if failed:
        word, css = "failed", "verdict bad"
        count = f"{len(failed)} of {len(lines)} experiments failed."
    elif not_run:
        word, css = "not all run", "verdict bad"
        count = f"{len(not_run)} of {len(lines)} experiments not run."
    else:
        word, css, count = "done", "verdict good", f"{len(lines)} of {len(lines)} experiments."
    yield element("p", element("strong", word, class_=css), count)
    for title, rows in (("What failed", failed), ("What was not run", not_run)):
        if rows:
            yield table(title, ("experiment", "why"), rows, "words")


def _card(line: Line, findings: Findings) -> Element:
    """Its name, its figure, its first plot and what it found first, leading to its page."""
    plot = next(iter(findings.plots.values()), None)
    if isinstance(plot, LinePlot):
        plot = replace(plot, width=_WIDTH, height=_HEIGHT)
    title = element("a", line.name, href=f"{line.name}.html", style=_LINK)
    return element(
        "article",
        element("h3", title, element("span", f" {line.experiment.figure}", class_="quiet")),
        element("p", line.experiment.title),
        None if plot is None else drawn(plot),
        *(element("p", each, style=_SMALL) for each in findings.sentences[:_SENTENCES]),
    )


def _numbers(lines: Sequence[Line]) -> Element:
    """Every number that the paper gives, and ours of the same name."""
    rows = [
        (
            line.name,
            line.experiment.figure,
            in_words(name),
            with_unit(name, value),
            _ours(line, name),
        )
        for line in lines
        for name, value in line.experiment.paper.items()
    ]
    head = ("experiment", "figure", "number", "paper", "ours")
    return table("What the paper's text gives in numbers", head, rows)


def _ours(line: Line, name: str) -> str:
    ours: Mapping[str, float | None] = {} if line.findings is None else line.findings.ours
    value = ours.get(name)
    return NOTHING if value is None else with_unit(name, value)
