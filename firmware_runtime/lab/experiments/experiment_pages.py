"""Pages of experiments: one of each, with what was found, and the index of a board's.

Findings and plots come first, then the paper's numbers beside ours, then the conditions.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from msgspec.structs import replace

from firmware_runtime.board.experiments import Experiment
from firmware_runtime.board.registry import Board
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.quantities import in_words, with_unit
from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.view.parts import (
    Beside,
    Bullets,
    Card,
    Folded,
    Link,
    Page,
    Part,
    Section,
    Series,
    Table,
    Text,
    Verdict,
    facts,
    section,
    table,
)

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
) -> Page:
    """The page of an experiment; `files` are what lies beside it."""
    opening: list[Part] = []
    if experiment.figure:
        opening.append(Text(text=experiment.figure, look="quiet"))
    if findings.sentences:
        opening.append(Bullets(items=findings.sentences))
    return Page(
        title=f"{board.name}: {experiment.title}",
        opening=opening,
        parts=list(_sections(board, experiment, findings, files)),
    )


def _sections(
    board: Board, experiment: Experiment, findings: Findings, files: Sequence[str]
) -> Iterator[Section]:
    yield section("Measured", *findings.plots.values())
    if experiment.paper or experiment.published:
        yield section(
            "Beside the paper",
            _beside_the_paper(experiment, findings) if experiment.paper else None,
            Bullets(items=experiment.published) if experiment.published else None,
        )
    if findings.tables or findings.ours:
        yield section("Figures", *findings.tables, _all_numbers(findings.ours))
    links = Bullets(items=[Link(name, name) for name in files])
    files_beside = Folded(title="Files beside this page", parts=[links])
    yield section("Conditions", _conditions(board, findings), files_beside)


def _beside_the_paper(experiment: Experiment, findings: Findings) -> Table:
    """The paper's numbers, each with ours."""
    paper = experiment.paper
    rows = [(in_words(name), _cell(paper, name), _cell(findings.ours, name)) for name in paper]
    return table("Numbers of the paper's text, and ours", ("", "paper", "ours"), rows)


def _all_numbers(ours: Mapping[str, float | None]) -> Folded | None:
    """All of ours, folded away: most of them are in the tables."""
    if not ours:
        return None
    rows = [(in_words(name), _cell(ours, name)) for name in ours]
    numbers = table("As results.json has them", ("", "ours"), rows)
    return Folded(title="All numbers of this experiment", parts=[numbers])


def _conditions(board: Board, findings: Findings) -> Table:
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


def index_page(board: str, lines: Sequence[Outcome]) -> Page:
    """The index: failures first, then each experiment with its plot and numbers."""
    cards = [_card(line, line.findings) for line in lines if line.findings is not None]
    return Page(
        title=f"{board}: experiments",
        opening=list(_outcomes(lines)),
        parts=[
            section("Experiments", Beside(parts=cards)),
            section("Beside the paper", _numbers(lines)),
            section("Conditions", facts("Of this machine", system_conditions())),
        ],
    )


def _outcomes(lines: Sequence[Outcome]) -> Iterator[Part]:
    """Say how many went well, and why the others did not."""
    failed = [(line.name, line.fault) for line in lines if line.fault is not None]
    not_run = [(line.name, line.not_run) for line in lines if line.not_run is not None]
    count = f"of {len(lines)} experiments"
    if failed:
        said = f"{len(failed)} {count} failed."
        yield Verdict(judgement="bad", word="failed", sentences=[said])
    elif not_run:
        said = f"{len(not_run)} {count} not run."
        yield Verdict(judgement="bad", word="not all run", sentences=[said])
    else:
        yield Verdict(judgement="good", word="done", sentences=[f"{len(lines)} {count}."])
    for title, rows in (("What failed", failed), ("What was not run", not_run)):
        if rows:
            yield table(title, ("experiment", "why"), rows, is_words=True)


def _card(line: Outcome, findings: Findings) -> Card:
    """Its name, its figure, its first plot and its first sentences, leading to its page."""
    first = next(iter(findings.plots.values()), None)
    plot = replace(first, is_small=True) if isinstance(first, Series) else first
    said = [Text(text=each, look="quiet") for each in findings.sentences[:_SENTENCES]]
    about: list[Part] = [Text(text=line.experiment.title)]
    return Card(
        title=Link(line.name, f"{line.name}.html"),
        note=line.experiment.figure,
        parts=[*about, *([] if plot is None else [plot]), *said],
    )


def _numbers(lines: Sequence[Outcome]) -> Table:
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
