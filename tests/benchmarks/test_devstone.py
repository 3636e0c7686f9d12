"""The models have as many transitions as published; the command reports what engines answer."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from benchmarks.devstone import bench as command
from benchmarks.devstone import shapes
from benchmarks.devstone.models import SHAPES, devstone
from benchmarks.devstone.shapes import transitions
from benchmarks.hold import measure as hold
from benchmarks.shared.side_by_side import PARTS, Sample
from firmware_runtime.cli.main import main
from firmware_runtime.devs.simulator import Simulator


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("width", [1, 2, 3, 6])
@pytest.mark.parametrize("depth", [1, 2, 4])
def test_every_shape_has_the_published_number_of_transitions(
    shape: str, width: int, depth: int
) -> None:
    simulator = Simulator(devstone(shape, width, depth))
    simulator.run(0)
    expected = transitions(shape, width, depth)
    assert simulator.internal_transitions - 1 == expected
    assert simulator.external_transitions == expected


@pytest.mark.parametrize(
    ("shape", "width", "both_kinds"),
    [("LI", 200, 7_564), ("HI", 200, 756_202), ("HO", 200, 756_202), ("HOmod", 20, 1_379_744)],
)
def test_the_formulas_give_the_known_numbers(shape: str, width: int, both_kinds: int) -> None:
    assert 2 * transitions(shape, width, 20) == both_kinds


@pytest.mark.parametrize(
    ("shape", "atomics"), [("LI", 16), ("HI", 16), ("HO", 16), ("HOmod", 3 * (5 + 15) + 1)]
)
def test_every_shape_has_the_published_number_of_atomics(shape: str, atomics: int) -> None:
    assert len(Simulator(devstone(shape, 6, 4)).atomics) - 1 == atomics


class Engines:
    """Stands for both engines: ours takes 1 s a part, the peer 3 s."""

    def __init__(self, counts: Mapping[str, int]) -> None:
        self.counts = counts

    def run_once(self, _module: str, *_arguments: object) -> Sample:
        return Sample(dict.fromkeys(PARTS, 3.0), self.counts)

    def in_turns(
        self, _modules: Sequence[str], repetitions: int, *_arguments: object
    ) -> list[list[Sample]]:
        ours, peers = Sample(dict.fromkeys(PARTS, 1.0), self.counts), self.run_once("")
        return [[ours] * repetitions, [peers] * repetitions]


def run(
    monkeypatch: pytest.MonkeyPatch, arguments: Sequence[str], counts: Mapping[str, int]
) -> int:
    engines = Engines(counts)
    for module in (shapes, hold):
        monkeypatch.setattr(module, "in_turns", engines.in_turns)
    monkeypatch.setattr(shapes, "run_once", engines.run_once)
    monkeypatch.setattr(command, "peer_version", lambda: "3.0.0")
    return main(["bench", "devstone", *arguments])


HI_3X2 = ("--shapes", "HI", "--width", "3", "--depth", "2", "--hold")
RIGHT = {"internal": 4, "external": 4}


def test_the_ratio_comes_last(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, HI_3X2, RIGHT) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "ratio 3.0 (HI, goal 11)"


def test_models_that_only_wait_show_how_their_cost_grows(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(hold, "transitions", lambda _kind, _count: 4)
    assert run(monkeypatch, ["--shapes", "--hold", "1", "50"], {"internal": 4}) == 0
    *_, growth, ratio = capsys.readouterr().out.splitlines()
    assert growth == (
        "from hold 1 distinct to hold 50 distinct a transition takes 1.0 times as long; "
        "xdevs.py: 1 times"
    )
    assert ratio == "ratio 3.0 (hold 50 distinct, goal 30)"


def test_json_has_conditions_seconds_transitions_and_the_ratio_last(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert run(monkeypatch, ["--json", "--save", str(tmp_path), *HI_3X2], RIGHT) == 0
    report = json.loads(capsys.readouterr().out)
    assert list(report) == ["conditions", "goals", "models", "worst", "ratio"]
    assert report["conditions"]["cpu_count"] >= 1
    (model,) = report["models"]
    assert model["seconds"]["xdevs.py"]["total"] == 9.0
    assert (model["transitions"], list(model)[-1], model["ratio"]) == (8, "ratio", 3.0)
    assert json.loads((tmp_path / "devstone.json").read_text()) == report


def test_an_engine_that_did_other_work_is_reported_and_fails_the_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, HI_3X2, {"internal": 4, "external": 5}) == 1
    assert "HI 3x2: xdevs.py counted" in capsys.readouterr().err


def test_without_the_peer_one_sentence_names_the_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "peer_version", lambda: None)
    assert main(["bench", "devstone"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "xdevs.py is not installed" in line
    assert "bench" in line
