"""docs/robots.md says of the detective's state diagrams what they are."""

import re
from pathlib import Path
from typing import NamedTuple

import pytest
from firmware_boards.detective.detective import Detective

from firmware_runtime.devs.time import NEVER
from firmware_runtime.devs.wiring import Wiring
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import State

PAGE = Path(__file__).parents[2] / "docs/robots.md"
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
    text = PAGE.read_text(encoding="utf-8")
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
