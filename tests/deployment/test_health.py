"""When a new version is kept: by the figures of a real run, a part of them changed."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from firmware_runtime.host.installation.health import complaints, not_compared
from firmware_runtime.statistics.figures import FaultFigures, Figures, figures_of

REAL = Path(__file__).parents[1] / "statistics" / "golden" / "real.json"


@pytest.fixture(scope="module")
def healthy() -> Figures:
    found = json.loads(REAL.read_text())
    found.pop("takeovers", None)
    return replace(figures_of(json.dumps(found), "real.json"), faults={}, late_by_cause={})


@dataclass
class Case:
    """What a new version's figures are, and what the complaint says; nothing for none."""

    changed: dict[str, Any]
    said: str = ""


def faults(count: int) -> dict[str, dict[str, FaultFigures]]:
    return {"imu": {"NoAcknowledge": FaultFigures(count, 0.1, 0.2, "imu: not acknowledged")}}


def step(figures: Figures, times: float, more_us: float = 0.0) -> dict[str, Any]:
    assert figures.step_us.p50 is not None
    return {"step_us": replace(figures.step_us, p50=figures.step_us.p50 * times + more_us)}


def cases(healthy: Figures) -> dict[str, Case]:
    """One each of what is wrong, and of what is no worse than it was."""
    run, steps = healthy.run, healthy.conditions.run.steps
    imu = healthy.models["imu"].run
    return {
        "the same": Case({}),
        "a chip that does not answer": Case({"faults": faults(imu)}, "imu: "),
        "a sample missed now and then": Case({"faults": faults(imu // 25)}),
        "late in a tenth": Case({"overruns": healthy.overruns + run // 10}, "are late"),
        "late in a hundredth": Case({"overruns": healthy.overruns + run // 100}),
        "a step of 3 ms more": Case(step(healthy, 1.0, 3000.0), "a step takes"),
        "a step a fifth longer": Case(step(healthy, 1.2)),
        "another cause": Case({"late_by_cause": {"garbage": steps // 20}}, "late by garbage"),
        "another cause, seldom": Case({"late_by_cause": {"garbage": steps // 200}}),
    }


def test_what_is_worse_than_before_is_said(healthy: Figures) -> None:
    for name, case in cases(healthy).items():
        said = list(complaints(replace(healthy, **case.changed), healthy))
        assert len(said) == bool(case.said), name
        assert all(case.said in each for each in said), name


def test_a_kind_of_fault_counts_by_how_often_it_came_before(healthy: Figures) -> None:
    usual = healthy.models["imu"].run // 2
    before = replace(healthy, faults=faults(usual))
    assert list(complaints(replace(healthy, faults=faults(usual + 3)), before)) == []
    seldom = replace(healthy, faults=faults(1))
    assert len(list(complaints(before, seldom))) == 1


def test_a_model_that_does_not_run_any_more_is_said(healthy: Figures) -> None:
    idle = {**healthy.models, "imu": replace(healthy.models["imu"], run=0)}
    assert [each[:4] for each in complaints(replace(healthy, models=idle), healthy)] == ["imu:"]


def test_on_another_computer_timing_is_not_compared(healthy: Figures) -> None:
    conditions = healthy.conditions
    moved = replace(conditions, stated={**conditions.stated, "machine": "aarch64"})
    before = replace(healthy, conditions=moved)
    slower = replace(healthy, **step(healthy, 10.0, 3000.0))
    assert list(complaints(slower, before)) == []
    assert "machine" in (not_compared(slower, before) or "")
    assert list(complaints(slower, None)) == []


def test_a_robot_that_does_not_run_is_not_healthy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    monkeypatch.setattr("firmware_runtime.host.installation.health.WITHIN_S", 0.0)
    words = ["service", "health", "tachobot", "--for", "1"]
    assert main(words) == Status.NOTHING_HAPPENED
    assert "tachobot: no activation" in capsys.readouterr().err


def test_a_robot_that_nobody_knows_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["service", "health", "tachobit"]) == Status.BAD_INPUT
    assert "tachobit" in capsys.readouterr().err
