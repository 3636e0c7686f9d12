import json
import sys

import pytest

from benchmarks.qss import bench
from firmware_runtime.cli.main import main


def test_without_scipy_a_sentence_gives_a_command_that_any_pip_takes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "scipy", None)
    assert main(["bench", "qss"]) == 2
    assert "-m pip install 'scipy>=" in capsys.readouterr().err


@pytest.mark.slow
def test_the_bench_compares_the_systems_of_the_page_at_equal_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["bench", "qss", "--json", "--repetitions", "1"]) == 0
    report = json.loads(capsys.readouterr().out)
    names = [each["name"] for each in report["systems"]]
    assert names == ["linear", "stiff", "bouncing ball", "Lotka-Volterra", "stick-slip"]
    for each in report["systems"]:
        assert 0.0 <= each["error"]["peer"] <= each["error"]["ours"] < 1e-2
        assert each["steps"]["ours"] > 0
        assert each["ratio"] == each["cpu_s"]["peer"] / each["cpu_s"]["ours"]


def test_the_ratio_comes_last() -> None:
    figures = {"steps": {"ours": 3, "peer": 2}, "error": {"ours": 1e-3, "peer": 1e-4}}
    each = {"name": "linear", "method": "QSS2", "peer": "RK45", **figures, "ratio": 0.5}
    each["cpu_s"] = {"ours": 2e-3, "peer": 1e-3}
    found = {"python": "", "system": "", "machine": "", "cpu": "", "cpus": 2, "load": 0.0}
    text = bench._text({"conditions": found, "systems": [each], "ratio": 0.5})
    assert text.splitlines()[-1].startswith("ratio 0.50")
