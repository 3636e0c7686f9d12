"""When safe-state was last called, as a run finds it that was starting."""

from pathlib import Path
from time import monotonic_ns

import pytest

from firmware_runtime.runs.watched_run import (
    last_safe_state,
    note_safe_state,
    safe_state_files,
)
from firmware_runtime.system.this_process import boot_id

PRESENT = f'"boot_id": "{boot_id()}"'


@pytest.fixture(autouse=True)
def directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    return tmp_path


def last(statistics: Path | None = None) -> int:
    return last_safe_state(safe_state_files("tachobot", statistics))


def test_the_last_call_is_found_wherever_the_run_keeps_its_own(directory: Path) -> None:
    assert last() == 0
    before = monotonic_ns()
    note_safe_state(directory / "tachobot.stats")
    between = monotonic_ns()
    assert before <= last() <= between
    assert last(directory / "mine.stats") == last()
    note_safe_state(directory / "elsewhere" / "mine.stats")
    assert last() <= between <= last(directory / "elsewhere" / "mine.stats") <= monotonic_ns()


@pytest.mark.parametrize(
    "content",
    [
        '{"boot_id": "another", "at_ns": 1}',
        f'{{{PRESENT}, "at_ns": {10**18}}}',
        f'{{{PRESENT}, "at_ns": -1}}',
        "",
        "[" * 100_000,
    ],
)
def test_a_call_of_another_boot_or_of_no_sense_is_none(directory: Path, content: str) -> None:
    path = directory / "tachobot.safe-state"
    path.write_text(content)
    assert last() == 0
    path.write_text(f'{{{PRESENT}, "at_ns": 1}}')
    assert last() == 1
