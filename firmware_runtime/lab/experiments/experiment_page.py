"""An experiment's page: what was found, plots, the paper's numbers beside ours, conditions."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from xml.etree.ElementTree import Element

from firmware_runtime.board.experiments import Experiment
from firmware_runtime.board.registry import Board
from firmware_runtime.lab.experiments.findings import Findings, Picture
from firmware_runtime.lab.experiments.quantities import in_words, with_unit
from firmware_runtime.lab.experiments.run_conditions import conditions
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.view.line_plot import LinePlot
from firmware_runtime.view.markup import element, table
from firmware_runtime.view.report.report import page_of, section


def experiment_page(
    board: Board, experiment: Experiment, findings: Findings, files: Sequence[str]
) -> str:
    """The page's text; `files` are what lies beside it."""
    return page_of(
        f"{board.name}: {experiment.title}", _sections(board, experiment, findings, files)
    )


def plot_figure(plot: LinePlot | Picture) -> Element:
    """A plot with its title above it."""
    return element("figure", element("figcaption", plot.title), drawn(plot))


def drawn(plot: LinePlot | Picture) -> Element:
    """A plot or picture as an element of a page."""
    return plot.svg() if isinstance(plot, LinePlot) else plot.image()


def beside_the_paper(ours: Mapping[str, float | None], paper: Mapping[str, float]) -> Element:
    """The paper's numbers, each with ours."""
    rows = [(in_words(name), _cell(paper, name), _cell(ours, name)) for name in paper]
    return table("Numbers of the paper's text, and ours", ("", "paper", "ours"), rows)


def _sections(
    board: Board, experiment: Experiment, findings: Findings, files: Sequence[str]
) -> Iterator[Element]:
    title = f"{board.name}: {experiment.title}"
    yield element("header", element("h1", title), *_opening(experiment, findings))
    yield section("Measured", *map(plot_figure, findings.plots.values()))
    if experiment.paper or experiment.published:
        yield section("Beside the paper", *_compared(experiment, findings))
    if findings.tables or findings.ours:
        yield section("Figures", *findings.tables, _numbers(findings.ours))
    yield section("Conditions", _conditions(board, findings), _files(files))


def _opening(experiment: Experiment, findings: Findings) -> Iterator[Element]:
    if experiment.figure:
        yield element("p", experiment.figure, class_="quiet")
    if findings.sentences:
        yield _list(findings.sentences)


def _compared(experiment: Experiment, findings: Findings) -> Iterator[Element]:
    if experiment.paper:
        yield beside_the_paper(findings.ours, experiment.paper)
    if experiment.published:
        yield _list(experiment.published)


def _numbers(ours: Mapping[str, float | None]) -> Element | None:
    """All of ours, folded away: most of them are in the tables."""
    if not ours:
        return None
    rows = [(in_words(name), _cell(ours, name)) for name in ours]
    numbers = table("As results.json has them", ("", "ours"), rows)
    return element("details", element("summary", "All numbers of this experiment"), numbers)


def _conditions(board: Board, findings: Findings) -> Element:
    """Machine and versions, then settings, then what was between the ends in each stage."""
    rows = [*conditions().items()]
    rows.append(("settings", ", ".join(board.assignments) or "as in the board's file"))
    for each in findings.between:
        stage, _, words = each.partition(": ")
        rows.append((f"stage {stage}", words))
    return table("Of this run", ("what", "value"), rows, "words")


def _files(names: Iterable[str]) -> Element:
    links = [element("li", element("a", name, href=name)) for name in names]
    return element("details", element("summary", "Files beside this page"), element("ul", *links))


def _list(sentences: Iterable[str]) -> Element:
    return element("ul", *(element("li", each) for each in sentences))


def _cell(numbers: Mapping[str, float | None], name: str) -> str:
    value = numbers.get(name)
    return NOTHING if value is None else with_unit(name, value)
