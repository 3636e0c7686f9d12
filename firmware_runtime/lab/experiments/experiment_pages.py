"""Pages of experiments: one of each, with what was found, and the index of a board's.

Findings and plots come first, then the paper's numbers beside ours, then the conditions.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

from firmware_runtime.board.experiments import Experiment
from firmware_runtime.board.registry import Board
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.quantities import in_words, with_unit
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.view.line_plot import LinePlot, figure_of
from firmware_runtime.view.markup import (
    bullets,
    element,
    facts,
    folded,
    opening,
    page_of,
    section,
    side_by_side,
    table,
    verdict_line,
)

_CARD_WIDTH, _CARD_HEIGHT = 600.0, 290.0
_LINK = "color:var(--blue)"
_SMALL = "font-size:.85rem;margin:.3rem 0"
_SENTENCES = 3


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of an experiment: its findings, why it failed, or why it was not run."""

    name: str
    experiment: Experiment
    findings: Findings | None = None
    fault: str | None = None
    not_run: str | None = None

    @property
    def ours(self) -> dict[str, float]:
        """Our numbers; what did not happen is left out."""
        found = {} if self.findings is None else self.findings.ours
        return {name: value for name, value in found.items() if value is not None}

    def entry(self) -> dict[str, object]:
        """Return its entry in results.json: figure, our numbers and the paper's, or why not."""
        reasons = {"failed": self.fault, "not_run": self.not_run}
        return {
            "figure": self.experiment.figure,
            "ours": self.ours,
            "paper": dict(self.experiment.paper),
            **{word: why for word, why in reasons.items() if why is not None},
        }


def experiment_page(
    board: Board, experiment: Experiment, findings: Findings, files: Sequence[str]
) -> str:
    """The text of an experiment's page; `files` are what lies beside it."""
    title = f"{board.name}: {experiment.title}"
    return page_of(title, _sections(title, board, experiment, findings, files))


def _sections(
    title: str, board: Board, experiment: Experiment, findings: Findings, files: Sequence[str]
) -> Iterator[Element]:
    figure = element("p", experiment.figure, class_="quiet") if experiment.figure else None
    yield opening(title, figure, bullets(findings.sentences) if findings.sentences else None)
    yield section("Measured", *map(figure_of, findings.plots.values()))
    if experiment.paper or experiment.published:
        yield section(
            "Beside the paper",
            _beside_the_paper(experiment, findings) if experiment.paper else None,
            bullets(experiment.published) if experiment.published else None,
        )
    if findings.tables or findings.ours:
        yield section("Figures", *findings.tables, _all_numbers(findings.ours))
    links = [element("a", name, href=name) for name in files]
    files_beside = folded("Files beside this page", bullets(links))
    yield section("Conditions", _conditions(board, findings), files_beside)


def _beside_the_paper(experiment: Experiment, findings: Findings) -> Element:
    """The paper's numbers, each with ours."""
    paper = experiment.paper
    rows = [(in_words(name), _cell(paper, name), _cell(findings.ours, name)) for name in paper]
    return table("Numbers of the paper's text, and ours", ("", "paper", "ours"), rows)


def _all_numbers(ours: Mapping[str, float | None]) -> Element | None:
    """All of ours, folded away: most of them are in the tables."""
    if not ours:
        return None
    rows = [(in_words(name), _cell(ours, name)) for name in ours]
    numbers = table("As results.json has them", ("", "ours"), rows)
    return folded("All numbers of this experiment", numbers)


def _conditions(board: Board, findings: Findings) -> Element:
    """Machine and versions, then settings, then what was between the ends in each stage."""
    stages = (each.partition(": ") for each in findings.between)
    return facts(
        "Of this run",
        {
            **system_conditions(),
            "settings": ", ".join(board.assignments) or "as in the board's file",
            **{f"stage {stage}": words for stage, _, words in stages},
        },
    )


def _cell(numbers: Mapping[str, float | None], name: str) -> str:
    value = numbers.get(name)
    return NOTHING if value is None else with_unit(name, value)


# The index ---------------------------------------------------------------------------------------


def index_page(board: str, lines: Sequence[Outcome]) -> str:
    """The text of the index: failures first, then each experiment with its plot and numbers."""
    title = f"{board}: experiments"
    return page_of(title, _index_sections(title, lines))


def _index_sections(title: str, lines: Sequence[Outcome]) -> Iterator[Element]:
    yield opening(title, *_outcomes(lines))
    cards = (_card(line, line.findings) for line in lines if line.findings is not None)
    yield section("Experiments", side_by_side(cards))
    yield section("Beside the paper", _numbers(lines))
    yield section("Conditions", facts("Of this machine", system_conditions()))


def _outcomes(lines: Sequence[Outcome]) -> Iterator[Element]:
    """Say how many went well, and why the others did not."""
    failed = [(line.name, line.fault) for line in lines if line.fault is not None]
    not_run = [(line.name, line.not_run) for line in lines if line.not_run is not None]
    if failed:
        count = f"{len(failed)} of {len(lines)} experiments failed."
        yield verdict_line("failed", "bad", count)
    elif not_run:
        count = f"{len(not_run)} of {len(lines)} experiments not run."
        yield verdict_line("not all run", "bad", count)
    else:
        yield verdict_line("done", "good", f"{len(lines)} of {len(lines)} experiments.")
    for title, rows in (("What failed", failed), ("What was not run", not_run)):
        if rows:
            yield table(title, ("experiment", "why"), rows, "words")


def _card(line: Outcome, findings: Findings) -> Element:
    """Its name, its figure, its first plot and its first sentences, leading to its page."""
    plot = next(iter(findings.plots.values()), None)
    if isinstance(plot, LinePlot):
        plot = replace(plot, width=_CARD_WIDTH, height=_CARD_HEIGHT)
    title = element("a", line.name, href=f"{line.name}.html", style=_LINK)
    return element(
        "article",
        element("h3", title, element("span", f" {line.experiment.figure}", class_="quiet")),
        element("p", line.experiment.title),
        None if plot is None else plot.svg(),
        *(element("p", each, style=_SMALL) for each in findings.sentences[:_SENTENCES]),
    )


def _numbers(lines: Sequence[Outcome]) -> Element:
    """Every number that the paper gives, and ours of the same name."""
    rows = [
        (
            line.name,
            line.experiment.figure,
            in_words(name),
            with_unit(name, value),
            _cell(line.ours, name),
        )
        for line in lines
        for name, value in line.experiment.paper.items()
    ]
    head = ("experiment", "figure", "number", "paper", "ours")
    return table("What the paper's text gives in numbers", head, rows)
