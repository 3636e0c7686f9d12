"""A state that grows without bound is named while the run can still be replayed."""

from pathlib import Path
from typing import Any

import pytest
from firmware_boards.tachobot.allocation import Allocation

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.recording.blackbox.keyframe_schedule import (
    KEYFRAME_EVERY,
    MISSING,
    KeyframeSchedule,
    KeyframeWarnings,
)
from tests.support.allocation import has_attribute
from tests.support.recorded import record


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def warnings(said: list[str]) -> KeyframeWarnings:
    found = KeyframeWarnings()
    found.log = said.append
    return found


def test_growth_is_said_once_where_it_takes_much(
    warnings: KeyframeWarnings, said: list[str]
) -> None:
    for size in (1000, 1999):
        warnings.taken(0, size, is_large=True)  # as large as it was made
    warnings.taken(0, 5000, is_large=False)
    assert said == []
    warnings.taken(0, 5000, is_large=True)
    warnings.taken(0, 6000, is_large=True)
    assert len(said) == 1


def test_one_missing_is_said_when_it_has_been_so_for_long(
    warnings: KeyframeWarnings, said: list[str]
) -> None:
    warnings.taken(SECOND, 1000, is_large=False)
    warnings.missed(MISSING, "busy", is_last_chunk=True)
    assert said == []
    for _ in range(2):
        warnings.missed(SECOND + MISSING, "busy", is_last_chunk=False)
    assert len(said) == 1


def test_a_run_that_never_had_one_says_so_before_its_start_is_written_over(
    warnings: KeyframeWarnings, said: list[str]
) -> None:
    warnings.missed(3600 * SECOND, "a lock", is_last_chunk=False)
    assert said == []
    warnings.missed(3600 * SECOND, "a lock", is_last_chunk=True)
    assert len(said) == 1


def test_after_a_large_one_the_next_is_due_with_the_next_chunk() -> None:
    schedule = KeyframeSchedule()
    schedule.taken(SECOND, 0)
    assert schedule.due_at == SECOND + KEYFRAME_EVERY
    schedule.taken(SECOND, 0, is_large=True)
    assert schedule.due_at == NEVER


def test_keyframes_that_end_again_are_said_again(
    warnings: KeyframeWarnings, said: list[str]
) -> None:
    for at in (SECOND, 100 * SECOND):
        warnings.taken(at, 1000, is_large=False)
        warnings.missed(at + MISSING, "busy", is_last_chunk=False)
    assert len(said) == 2


def test_a_run_that_will_have_none_says_so_at_once(
    warnings: KeyframeWarnings, said: list[str]
) -> None:
    for _ in range(2):
        warnings.cannot("controller.line: a socket")
    (found,) = said
    assert "controller.line: a socket" in found


@pytest.mark.slow
def test_the_field_that_grows_is_named(
    tmp_path: Path, said: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    enter = Allocation.external

    def entered(self: Any, elapsed: int) -> None:  # noqa: ANN401 -- any model
        enter(self, elapsed)
        self.log += [len(self.log) + each / 2 for each in range(20)]

    has_attribute(monkeypatch, "log", lambda _: [])
    monkeypatch.setattr(Allocation, "external", entered)
    path = tmp_path / "run.recording"
    record(path, "tachobot", 41, ["recording.minutes=0.5"], log=said.append)
    grown, missing = said[:2]
    assert "controller.allocation.log" in grown
    assert "no keyframe since" in missing
