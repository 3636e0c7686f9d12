"""What speaks against a plant that is tuned for is said beside the gains."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from firmware_runtime.cli.commands import tune
from firmware_runtime.lab.identification.plant import KEYS, PlantParameters
from firmware_runtime.lab.tuning import search
from firmware_runtime.lab.tuning.task import stated_plant

WARNING = "the plant explains 0% of the output's variance; expected 90 % or more"
VALUES = dict(zip(KEYS["rotation"], (0.15, 0.02, 0.0, 0.0, 0.03), strict=True))


@pytest.fixture
def identified(tmp_path: Path) -> Path:
    """A file as `identify -o` writes it, of another board's run that showed nothing."""
    parameters = {key: {"value": each, "low": each, "high": each} for key, each in VALUES.items()}
    document = {"board": "mast", "parameters": parameters, "noise": {"deviation": 0.0}}
    path = tmp_path / "mast.json"
    path.write_text(json.dumps({**document, "warnings": [WARNING]}))
    return path


def test_a_file_has_the_doubts_of_its_identification_and_its_board(identified: Path) -> None:
    *_, (warned, foreign) = stated_plant(str(identified), "rotation", "tachobot")
    assert (warned, "the plant of mast" in foreign) == (WARNING, True)
    assert stated_plant(str(identified), "rotation", "mast")[3] == [WARNING]


def test_a_plant_may_come_through_a_pipe(identified: Path) -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb"):
        os.write(writing, identified.read_bytes())
        os.close(writing)
        plant, *_, doubts = stated_plant(f"/dev/fd/{reading}", "rotation", "mast")
    assert plant == PlantParameters(*VALUES.values())
    assert doubts == [WARNING]


@pytest.mark.slow
def test_doubts_are_printed_beside_the_gains(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, identified: Path
) -> None:
    monkeypatch.setattr(search, "_GENERATIONS", 1)
    shown = command("tune", "tachobot", "--plant", identified)
    assert f"warning: {WARNING}" in shown.out
    found = json.loads(command("tune", "tachobot", "--plant", identified, "--json").out)
    assert found["warnings"][0] == WARNING


@pytest.mark.slow
def test_a_run_that_shows_hardly_anything_is_said_too(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, identified: Path
) -> None:
    monkeypatch.setattr(search, "_GENERATIONS", 1)
    found = json.loads(identified.read_text())["parameters"]
    estimates = {key: SimpleNamespace(**each) for key, each in found.items()}
    told = SimpleNamespace(
        parameters=estimates,
        plant=PlantParameters(*VALUES.values()),
        noise=0.0,
        warnings=[WARNING],
    )
    monkeypatch.setattr(tune, "identified_from", lambda *_words: (None, told, None))
    assert f"warning: {WARNING}" in command("tune", "tachobot", "--from", "any").out
