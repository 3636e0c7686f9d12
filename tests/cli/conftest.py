from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def state_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where this test's statistics are kept."""
    directory = tmp_path / "state"
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(directory))
    return directory
