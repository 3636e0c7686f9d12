"""`bench gate`: one decision of each kind beside no neighbour, without times."""

import json
from pathlib import Path

import pytest

from benchmarks.gate.versions import _copy
from firmware_runtime.cli.main import main


@pytest.mark.slow
def test_one_decision_of_each_kind(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--decisions", "1", "--neighbours", "0", "--longer", "400", "--save", str(tmp_path)]
    assert main(["bench", "gate", *words]) == 0
    report = json.loads((tmp_path / "gate.json").read_text())
    kinds = report["kinds"]
    assert kinds["a longer step"]["verdicts"]["slower"] == 1
    assert sum(kinds["the same code"]["verdicts"].values()) == 1
    assert report["turns"] > 0
    assert report["apart"]["processors"] >= 1
    printed = capsys.readouterr().out.splitlines()
    assert printed[-1] == f"ratio {report['ratio']:.3f} (the longer step by the plain one)"


@pytest.mark.slow
def test_the_longer_step_differs_in_one_file(tmp_path: Path) -> None:
    plain, longer = _copy(tmp_path / "plain", 0).folder, _copy(tmp_path / "longer", 7).folder
    files = [each.relative_to(plain) for each in sorted(plain.rglob("*.py"))]
    differing = [
        str(each) for each in files if (plain / each).read_text() != (longer / each).read_text()
    ]
    assert differing == ["boards/tachobot/allocation.py"]
    assert "range(7)" in (longer / differing[0]).read_text()
