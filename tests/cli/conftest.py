from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from firmware_runtime.cli.main import main


class Ended(NamedTuple):
    """What a command left: its exit status and what it printed."""

    status: int
    out: str
    error: str


@pytest.fixture(autouse=True)
def state_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where this test's statistics are kept."""
    directory = tmp_path / "state"
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(directory))
    return directory


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Callable[..., Ended]:
    """Runs the command in this process."""

    def run(*arguments: object) -> Ended:
        try:
            status = main([str(each) for each in arguments])
        except SystemExit as exit_:
            status = int(exit_.code or 0)
        return Ended(status, *capsys.readouterr())

    return run
