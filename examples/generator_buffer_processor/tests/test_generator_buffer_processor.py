"""Figure 1 on its event file, and what happens beside it."""

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import pytest
from generator_buffer_processor.top import ATOMIC_CLASSES, Top

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.ecdpp.atomic_class import known_classes
from firmware_runtime.ecdpp.event_file import parse_events
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.model_file import read_model
from firmware_runtime.ecdpp.model_writer import model_text

FILES = Path(str(files("generator_buffer_processor")))


def from_file() -> Coupled:
    return read_model(FILES / "top.ma", known_classes())


def played(model: Coupled, events: str) -> list[str]:
    return [str(line) for line in run_events(model, parse_events(events, "", model), checked=True)]


@pytest.mark.parametrize("build", [Top, from_file])
def test_jobs_leave_at_the_instants_that_were_computed_by_hand(
    build: Callable[[], Coupled],
) -> None:
    lines = played(build(), (FILES / "jobs.ev").read_text())
    assert lines == [
        "00:00:03:600 out 1",
        "00:00:05:200 out 2",
        "00:00:06:800 out 3",
        "00:00:08:400 out 4",
    ]
    assert lines == (FILES / "jobs.out").read_text().splitlines()


def test_the_file_is_what_the_python_model_is_exported_as() -> None:
    def links(text: str) -> list[str]:
        return [line for line in text.splitlines() if line.startswith(("Link", "[", "p"))]

    assert links(model_text(Top(), ATOMIC_CLASSES)) == links((FILES / "top.ma").read_text())


def test_switched_on_again_it_goes_on_counting_and_what_is_on_is_not_changed() -> None:
    events = "00:00:00:000 in 1\n00:00:01:500 in 0\n00:00:20:000 in 1\n00:00:21:500 in 0"
    assert played(Top(), events) == ["00:00:02:600 out 1", "00:00:22:600 out 2"]
    events = "00:00:00:000 in 1\n00:00:00:900 in 1\n00:00:01:500 in 0"
    assert played(Top(), events) == ["00:00:02:600 out 1"]
