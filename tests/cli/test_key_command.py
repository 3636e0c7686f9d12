"""`firmware-runtime new key`."""

from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.links.key_file import read_key


def test_a_key_is_made_once_and_never_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "robot.key"
    assert main(["new", "key", str(path)]) == 0
    printed = capsys.readouterr().out
    key = read_key(path)
    assert str(path) in printed
    assert key.hex() not in printed
    assert main(["new", "key", str(path)]) == 2
    assert read_key(path) == key
    assert "overwritten" in capsys.readouterr().err
