"""docs/robots.md and docs/papers.md say what the models, commands and files are."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

import pytest
from firmware_boards.detective.detective import Detective

from firmware_runtime.board import registry
from firmware_runtime.board.experiments import ALL
from firmware_runtime.cli.main import parser
from firmware_runtime.devs.time import NEVER
from firmware_runtime.devs.wiring import Wiring
from firmware_runtime.lab.experiments.known import experiments_of
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import State

ROBOTS = Path(__file__).parents[2] / "docs/robots.md"
SECTIONS = {
    "Radar controller": ["radarController"],
    "Movement controller": ["movementController"],
    "Motor1, Motor2, Motor3": ["motor1", "motor2", "motor3"],
    "Sonar1": ["sonar1"],
    "Compass1": ["compass1"],
    "Sonar2": ["sonar2"],
    "Compass2": ["compass2"],
}
"""Each heading of the page, and the models it is about."""


class Tables(NamedTuple):
    """The rows of a section's two tables, without the columns that no model has."""

    states: list[list[str]]
    arrows: list[list[str]]


def tables(section: str) -> Tables:
    text = ROBOTS.read_text(encoding="utf-8")
    body = text.split(f"\n### {section}\n", 1)[1].split("\n### ", 1)[0]
    found = [
        [[cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines()[2:]]
        for block in re.findall(r"(?:^\|.*\n)+", body, re.MULTILINE)
    ]
    states, arrows = found
    assert all(row[-1] for row in (*states, *arrows))
    return Tables([row[:4] for row in states], [row[:3] for row in arrows])


def expected(states: tuple[State, ...]) -> Tables:
    arrows = [
        [
            state.name,
            f"`{arrow.label}`" + (f", when {arrow.condition}" if arrow.condition else ""),
            arrow.to,
        ]
        for state in states
        for arrow in state.arrows
    ]
    rows = [
        [
            state.name,
            "until an input" if state.duration == NEVER else f"`{state.duration}`",
            str(sum(to == state.name for *_, to in arrows)),
            str(len(state.arrows)),
        ]
        for state in states
    ]
    return Tables(rows, arrows)


@pytest.mark.parametrize("section", SECTIONS)
def test_the_page_has_each_state_and_arrow_of_the_models(section: str) -> None:
    atomics = {atomic.name: atomic for atomic in Wiring(Detective()).atomics}
    for name in SECTIONS[section]:
        model = atomics[name]
        assert isinstance(model, StateDiagram)
        assert tables(section) == expected(tuple(model.states))


def test_every_model_is_on_the_page() -> None:
    named = [name for names in SECTIONS.values() for name in names]
    assert sorted(named) == sorted(atomic.name for atomic in Wiring(Detective()).atomics)


ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/papers.md"
HEAD = ["the paper", "where", "ours", "the paper's figure", "ours"]
FILE = re.compile(r"[\w.-]+(/[\w.-]+)+")


def rows() -> list[list[str]]:
    found = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in PAGE.read_text(encoding="utf-8").splitlines()
        if line.startswith("|") and not line.startswith("|---")
    ]
    assert found[0] == HEAD
    return [row for row in found if row != HEAD]


ROWS = rows()
CODE = sorted({code for row in ROWS for cell in row[2:] for code in re.findall(r"`([^`]+)`", cell)})
COMMANDS = [code for code in CODE if code.startswith("firmware-runtime ")]
FILES = [code for code in CODE if FILE.fullmatch(code)]


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_is_one_of_ours(command: str) -> None:
    _, *words = shlex.split(command)
    parsed = parser(words).parse_args(words)
    for word in words:
        assert not word.startswith(("examples/", "boards/")) or (ROOT / word).exists()
    if getattr(parsed, "events", None):
        assert (ROOT / parsed.events).exists()
    if parsed.verb == "try" and "--channel" in words:
        assert "--duty" in words or "--pulse-us" in words
    if parsed.verb == "experiment":
        _, name, board, *_ = words
        assert name in {*experiments_of(registry.load(board)), ALL}
    elif getattr(parsed, "board", None) and not parsed.board.endswith(".ma"):
        whole = parsed.verb != "sweep"  # there, what is varied belongs to the assignments
        registry.load(parsed.board, getattr(parsed, "assignments", ()) if whole else ())


@pytest.mark.parametrize("command", COMMANDS)
def test_a_shell_takes_each_command_as_it_stands(command: str) -> None:
    unquoted = re.sub(r"'[^']*'", "", command)
    assert not set(unquoted) & set("'\"()<>|&;*?$\\"), command


def test_the_sweep_is_the_one_whose_figures_its_page_has() -> None:
    sweeps = (ROOT / "docs/experiments.md").read_text(encoding="utf-8").replace("\\\n", " ")
    (command,) = [each for each in COMMANDS if each.split()[1] == "sweep"]
    assert command in " ".join(sweeps.split())


@pytest.mark.parametrize("file", FILES)
def test_each_file_is_there(file: str) -> None:
    assert (ROOT / file).exists()


def test_every_row_says_what_shows_ours_or_why_nothing_does_and_every_figure_has_one() -> None:
    for row in ROWS:
        assert len(row) == len(HEAD), row
        assert row[2], row
        missing = [cell for cell in row if "missing" in cell]
        assert all(len(cell.partition("missing:")[2].split()) > 4 for cell in missing), row
    dover, military = PAGE.read_text(encoding="utf-8").split("\n## Application of RT-DEVS")
    for text, last in ((dover, 17), (military, 6)):
        found = {int(number) for number in re.findall(r"\| Figures? (\d+)", text)}
        found |= {int(number) for number in re.findall(r"\| Figures \d+, (\d+)", text)}
        assert found == set(range(1, last + 1))
