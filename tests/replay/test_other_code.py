"""A robot whose code has changed since: what can be compared is, and what cannot is said."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.pid import Pid
from firmware_runtime.recording.blackbox import keyframe_schedule
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.recording.debugger.travel import Travel
from firmware_runtime.recording.replay.stretch import Stretch
from firmware_runtime.recording.replay.verdict import replay
from tests.support.allocation import has_attribute
from tests.support.recorded import record
from tests.support.replayed import opened

MODULE = "firmware_runtime.models.pid"
Flight = tuple[Recording, Board]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six seconds of a run, keyframes included."""
    path = tmp_path_factory.mktemp("flight") / "tachobot.recording"
    return record(path, "tachobot", 6, ["recording.minutes=10"])


@pytest.fixture
def flight(path: Path) -> Flight:
    return opened(path)


@pytest.fixture
def other_field(flight: Flight, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: ARG001 -- before
    """From now on controllers have a field more than in the flight."""
    build: Callable[..., None] = Pid.__init__

    def with_another(self: Pid, *arguments: Any) -> None:  # noqa: ANN401 -- as they are
        build(self, *arguments)
        vars(self)["trim_n"] = [0.0]

    monkeypatch.setattr(Pid, "__init__", with_another)


def _as_if_changed(recording: Recording) -> None:
    assert MODULE in recording.header.code
    recording.header.code[MODULE] = "of another source"


@pytest.mark.usefixtures("other_field")
def test_its_values_are_compared_and_its_states_are_said_not_to_be(flight: Flight) -> None:
    _as_if_changed(flight[0])
    verdict = replay(*flight)
    assert (verdict.is_identical, verdict.differences) == (None, 0)
    assert verdict.compared == verdict.values > 100
    assert verdict.code_changed == [MODULE]
    sections = [each for part in flight[0].segments() for each in part.sections()]
    keyframes = [each.kind for each in sections].count(Kind.KEYFRAME)
    assert verdict.uncompared == keyframes > 1
    assert verdict.not_compared[0].startswith(
        f"the state at {verdict.uncompared} keyframes: other code"
    )
    assert verdict.as_json()["states_not_compared"] == verdict.uncompared


@pytest.mark.usefixtures("other_field")
def test_it_cannot_begin_in_the_middle(flight: Flight) -> None:
    _as_if_changed(flight[0])
    with pytest.raises(ConfigError, match=r"its models are not those of .* expected the code of"):
        replay(*flight, Stretch(begin=4 * SECOND))


@pytest.mark.usefixtures("other_field")
def test_where_no_code_has_changed_it_is_no_verdict(flight: Flight) -> None:
    with pytest.raises(ConfigError, match="a keyframe"):
        replay(*flight)


def test_what_is_built_otherwise_is_found_at_the_keyframe_that_it_begins_at(
    flight: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    has_attribute(monkeypatch, "timeout", lambda model: model.timeout + 1)
    first = replay(*flight, Stretch(begin=5 * SECOND + SECOND // 2)).first
    assert first is not None
    assert (first.at, first.what) == (5 * SECOND, "state")
    assert first.where == "controller.allocation.timeout"


def test_states_of_the_same_form_are_compared(flight: Flight) -> None:
    _as_if_changed(flight[0])
    verdict = replay(*flight)
    assert verdict.is_identical
    assert verdict.not_compared == []


@pytest.mark.usefixtures("other_field")
def test_one_can_go_forward_and_back_in_it(flight: Flight) -> None:
    _as_if_changed(flight[0])
    travel = Travel(*flight, None)
    last: dict[int, dict[str, Any]] = {}
    for at in (5 * SECOND, 3 * SECOND, 5 * SECOND):
        travel.go_to(travel.index_after(at))
        assert travel.at == at
        assert last.setdefault(at, dict(travel.last)) == travel.last
    assert len(last[5 * SECOND]) > 3


def test_one_can_go_back_to_just_behind_a_keyframe_that_is_of_no_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keyframe_schedule, "KEYFRAME_EVERY", 200 * MILLISECOND)
    recording, board = opened(record(tmp_path / "x.recording", "tachobot", 0.4))
    has_attribute(monkeypatch, "more", lambda _: 0)
    _as_if_changed(recording)
    travel = Travel(recording, board, None)
    while travel.at < 400 * MILLISECOND:
        travel.take()
    place = travel.index_after(300 * MILLISECOND)
    travel.go_to(place)
    assert (travel.at, travel.index) == (300 * MILLISECOND, place)
