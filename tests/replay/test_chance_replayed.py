"""A model that draws from the process's own generators draws the same in its replay."""

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boards.tachobot.allocation import Allocation
from drivers.thrust_pairs import Forces
from firmware_runtime.blackbox.reader import read_recording
from firmware_runtime.blackbox.section import Kind, sent_of
from firmware_runtime.recording import chance
from firmware_runtime.recording.of_board import board_of_table
from firmware_runtime.replay.verdict import replay
from tests.support.recorded import record
from tests.support.replayed import check_identical

SPAN_S = 1.0


@pytest.fixture
def uncertain(monkeypatch: pytest.MonkeyPatch) -> None:
    """TachoBot's allocation is off by chance: as it was built, and each time it answers."""
    build, output = Allocation.__init__, Allocation.output

    def built(self: Any, name: str, thrust: float, timeout: int) -> None:  # noqa: ANN401
        build(self, name, thrust, timeout)
        self.offset = random.random()  # noqa: S311

    def sent(self: Any) -> None:  # noqa: ANN401
        noise = random.gauss(0, 0.01) + float(np.random.normal(0, 0.01))  # noqa: NPY002
        self.forces = Forces(*(each + noise + self.offset for each in self.forces))
        output(self)

    monkeypatch.setattr(Allocation, "__init__", built)
    monkeypatch.setattr(Allocation, "output", sent)


@pytest.mark.slow
@pytest.mark.usefixtures("uncertain")
def test_what_a_model_drew_is_drawn_again(tmp_path: Path) -> None:
    np.random.seed(7)  # noqa: NPY002 -- imported before the run, as a board's module would
    path = record(tmp_path / "run", "tachobot", SPAN_S)
    random.seed(1)
    np.random.seed(8)  # noqa: NPY002
    check_identical(path)
    recording = read_recording(path)
    board = board_of_table(recording.header.source, recording.header.table)
    assert replay(recording, board).has_drawn
    other = record(tmp_path / "other", "tachobot", SPAN_S)
    assert _sent(path) != _sent(other)


def _sent(path: Path) -> list[object]:
    (segment,) = read_recording(path).segments()
    return [sent_of(each) for each in segment.sections() if each.kind is Kind.STEP]


def test_places_are_put_back_and_what_is_none_is_left_alone() -> None:
    places = chance.places()
    drawn = random.random(), random.gauss(0, 1)  # noqa: S311
    chance.put(places)
    assert (random.random(), random.gauss(0, 1)) == drawn  # noqa: S311
    before = random.getstate()
    for strange in (None, 7, [], [3, b"abc", None, None], [3, b"", None, None], "letter"):
        chance.put(strange)
        assert random.getstate() == before
