"""A model that draws from the process's own generators draws the same in its replay."""

import json
import random
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.host.scaffold.package import write_robot
from firmware_runtime.recording.blackbox import keyframe_schedule
from firmware_runtime.recording.blackbox import state_of_run as chance
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.section import Kind, decode, sent_of
from firmware_runtime.recording.debugger.travel import Travel
from firmware_runtime.recording.replay.stretch import Stretch
from firmware_runtime.recording.values import unpack
from tests.support.allocation import has_attribute, sends
from tests.support.command import Command
from tests.support.recorded import every_section, record
from tests.support.replayed import check_identical, opened, replayed
from tests.support.written_package import as_installed

SPAN_S = 1.6
EVERY = 300 * MILLISECOND
BEGINS = (0.35, 0.95, 1.25, 1.55)
"""Seconds, each behind another keyframe."""


@pytest.fixture(autouse=True)
def keyframes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some keyframes in a short run."""
    monkeypatch.setattr(keyframe_schedule, "KEYFRAME_EVERY", EVERY)


@pytest.fixture
def uncertain(monkeypatch: pytest.MonkeyPatch) -> None:
    """TachoBot's allocation is off by chance: as it was built, and each time it answers."""
    has_attribute(monkeypatch, "offset", lambda _: random.random())  # noqa: S311

    def off(model: Any, force: float) -> float:  # noqa: ANN401
        drawn: float = random.gauss(0, 0.01) + np.random.normal(0, 0.01) + model.offset  # noqa: NPY002
        return force + drawn

    sends(monkeypatch, off)


def check_from_keyframes(path: Path) -> None:
    """Assert that the run is its replay from each of its keyframes."""
    for begin_s in BEGINS:
        random.seed(begin_s)
        verdict = check_identical(path, 0, Stretch(begin=round(begin_s * SECOND)))
        assert 0 < verdict.duration < (SPAN_S - begin_s) * SECOND + 2 * EVERY


@pytest.mark.slow
@pytest.mark.usefixtures("uncertain")
def test_what_a_model_drew_is_drawn_again(tmp_path: Path) -> None:
    np.random.seed(7)  # noqa: NPY002 -- imported before the run, as a board's module would
    path = record(tmp_path / "run", "tachobot", SPAN_S)
    random.seed(1)
    np.random.seed(8)  # noqa: NPY002
    assert check_identical(path).has_drawn
    check_from_keyframes(path)
    other = record(tmp_path / "other", "tachobot", SPAN_S)
    assert _sent(path) != _sent(other)


@pytest.mark.slow
def test_what_is_first_drawn_behind_a_keyframe_is_drawn_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    has_attribute(monkeypatch, "sent", lambda _: 0)

    def late(model: Any, force: float) -> float:  # noqa: ANN401
        model.sent += 1
        return force + (random.random() if model.sent > 160 else 0.0)  # noqa: S311 -- of some 320

    sends(monkeypatch, late)
    path = record(tmp_path / "run", "tachobot", SPAN_S)
    drawn_from = _drawn_from(path)
    assert (drawn_from[0], drawn_from[-1]) == (False, True)
    assert check_identical(path).has_drawn
    check_from_keyframes(path)


def test_of_a_run_in_which_nothing_was_drawn_that_is_said(tmp_path: Path) -> None:
    path = record(tmp_path / "run", "tachobot", SPAN_S)
    random.seed(1)
    assert not check_identical(path).has_drawn
    assert set(_drawn_from(path)) == {False}


@pytest.mark.slow
def test_a_generator_of_a_model_without_a_seed_is_in_its_keyframes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    has_attribute(monkeypatch, "generator", lambda _: np.random.default_rng())
    sends(monkeypatch, lambda model, force: force + float(model.generator.normal(0, 0.01)))
    path = record(tmp_path / "run", "tachobot", SPAN_S)
    check_from_keyframes(path)
    assert not replayed(path).has_drawn


@pytest.mark.usefixtures("uncertain")
def test_going_back_in_the_debugger_draws_the_same_again(tmp_path: Path) -> None:
    path = record(tmp_path / "run", "tachobot", SPAN_S)
    travel = Travel(*opened(path), None)
    for second in (0.95, 0.4, 0.7):
        travel.go_to(travel.index_after(round(second * SECOND)))
        assert travel.player.first is None


@pytest.mark.slow
def test_a_replay_says_that_they_were_drawn_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    path = tmp_path / "run.recording"
    with monkeypatch.context() as patched:
        sends(patched, lambda _, force: force)
        record(path, "tachobot", 1.0)
        assert not replayed(path).has_drawn
    sends(monkeypatch, lambda _, force: force + random.random())  # noqa: S311
    assert json.loads(command("replay", path, "--json").out)["has_drawn"] is True
    assert chance.UNKEPT in command("replay", path).out


def _drawn_from(path: Path) -> list[bool]:
    """Of each keyframe whether it says where the generators stood."""
    keyframes = [each for each in map(decode, every_section(path)) if each.kind is Kind.KEYFRAME]
    assert len(keyframes) > 3
    return [unpack(each.extra)[-1] is not None for each in keyframes]


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


def test_back_where_numpy_had_not_been_loaded_it_begins_again() -> None:
    stood, before, drawn = chance.places(), np.random.get_state(), list[float]()  # noqa: NPY002
    for _ in range(2):
        chance.Places([*stood[:3], None]).put(None)
        drawn.append(np.random.normal())  # noqa: NPY002
    assert drawn[0] == drawn[1]
    np.random.set_state(before)  # noqa: NPY002


def test_a_numpy_without_generators_is_missed_as_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    monkeypatch.setattr(np, "__path__", [])
    stood = chance.places()
    monkeypatch.delitem(sys.modules, "numpy.random", raising=False)
    chance.begin_late([*stood[:3], None])
    with pytest.raises(ModuleNotFoundError):
        import_module("numpy.random")


LATE = """
import os
import numpy as np
from firmware_runtime.recording.blackbox import state_of_run as chance

stood = chance.places()
stood[3] = None
chance.begin_late(stood)
chance.begin_late(stood)
print("loaded" if "numpy.random" in __import__("sys").modules else "not loaded")
drawn = float(np.random.normal())
chance.begin_late(stood)
print(drawn == float(np.random.normal()), np.random.__spec__.loader is np.random.__loader__)
print(float(np.random.default_rng(1).normal()) > 0)
"""


@pytest.mark.slow
def test_numpy_begins_at_the_same_place_whenever_it_loads_its_generator() -> None:
    ran = subprocess.run(
        [sys.executable, "-c", LATE], capture_output=True, text=True, timeout=120, check=False
    )
    assert ran.stderr == ""
    assert ran.stdout.split("\n")[:3] == ["not loaded", "True True", "True"]


@pytest.mark.slow
def test_a_robot_that_draws_from_numpy_alone_is_its_replay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_robot("rover", tmp_path / "rover")
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    rover = as_installed(tmp_path / "rover", tmp_path / "site")
    head = tmp_path / "rover/rover/head.py"
    drawn = "* seconds + 0.01 * float(np.random.normal())"
    text = head.read_text().replace("* seconds", drawn)
    head.write_text(text.replace("\nfrom", "\nimport numpy as np\n\nfrom", 1))
    assert drawn in head.read_text()
    ran = rover.command("run", "rover", "--doubles", "--clock", "virtual", "--for", "7")
    assert ran.returncode == 0, ran.stderr
    for words in ([], ["--from", "5.5"]):
        again = rover.command("replay", "rover", *words)
        assert again.stdout.startswith("identical"), again.stdout + again.stderr


def test_of_many_places_where_numpy_would_begin_only_the_last_is_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "numpy.random", raising=False)
    monkeypatch.setattr(sys, "meta_path", finders := [*sys.meta_path])
    before, stood = len(finders), [*chance.places()[:3], None]
    for expected in (before + 1, before + 1):
        chance.begin_late(stood)
        assert len(finders) == expected
    chance.begin_late([*stood[:3], "where numpy stood"])
    assert len(finders) == before
