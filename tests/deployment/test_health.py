"""When a new version is kept: by the figures of a real run, a part of them changed."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from firmware_runtime.host.installation.health import PARTS, Trial, complaints, not_compared
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
        said = list(complaints(Trial(replace(healthy, **case.changed)), healthy))
        assert len(said) == bool(case.said), name
        assert all(case.said in each for each in said), name


def test_a_kind_of_fault_counts_by_how_often_it_came_before(healthy: Figures) -> None:
    usual = healthy.models["imu"].run // 2
    before = replace(healthy, faults=faults(usual))
    assert list(complaints(Trial(replace(healthy, faults=faults(usual + 3))), before)) == []
    seldom = replace(healthy, faults=faults(1))
    assert len(list(complaints(Trial(before), seldom))) == 1


def test_a_fault_of_a_model_that_answers_inputs_counts_by_its_answers(healthy: Figures) -> None:
    attitude = healthy.models["controller.attitude"]
    assert attitude.run == 0
    for count, is_said in ((attitude.reactions // 25, False), (attitude.reactions // 15, True)):
        missed = {"NotFinite": FaultFigures(count, 0.1, 0.2, "a rate of nan")}
        figures = replace(healthy, faults={"controller.attitude": missed})
        assert bool(list(complaints(Trial(figures), healthy))) == is_said


def with_imu(figures: Figures, share: float, period_us: float = 10_000.0) -> Figures:
    """Figures in which the sensor, of this period, was due a share of its times."""
    imu = figures.models["imu"]
    few = replace(imu, scheduled=int(share * imu.scheduled), period_us=period_us)
    return replace(figures, models={**figures.models, "imu": few})


def test_a_model_that_is_due_less_than_half_as_often_is_said_with_both_rates(
    healthy: Figures,
) -> None:
    def said(share: float) -> list[str]:
        return list(complaints(Trial(with_imu(healthy, share)), healthy))

    assert said(0.0) == ["imu was due 0 times a second, 100 before"]
    assert said(0.25) == ["imu was due 25 times a second, 100 before"]
    assert said(0.45) != []
    assert said(0.55) == []


def test_where_much_was_late_before_half_as_much_again_is_no_complaint(healthy: Figures) -> None:
    steps, run = healthy.conditions.run.steps, healthy.run

    def late(share: float) -> Figures:
        causes = {"model": int(share * steps)}
        return replace(healthy, overruns=int(share * run), late_by_cause=causes)

    assert list(complaints(Trial(late(0.12)), late(0.08))) == []
    assert len(list(complaints(Trial(late(0.20)), late(0.08)))) == 2


def test_what_a_busy_computer_skips_was_due(healthy: Figures) -> None:
    imu = healthy.models["imu"]
    skips = replace(imu, run=imu.run // 4, skipped=imu.scheduled - imu.run // 4)
    busy = replace(healthy, models={**healthy.models, "imu": skips})
    for before in (healthy, None):
        assert list(complaints(Trial(busy), before)) == []


def test_a_model_that_stops_in_the_middle_is_said(healthy: Figures) -> None:
    parts = [healthy] * PARTS
    for part in range(PARTS):
        stops = Trial(healthy, (*parts[:part], with_imu(healthy, 0.0), *parts[part + 1 :]))
        assert list(complaints(stops, healthy)) == ["imu was due 0 times a second, 100 before"]
    assert list(complaints(Trial(healthy, tuple(parts)), healthy)) == []


def test_a_model_that_was_not_there_before_runs_by_its_period(healthy: Figures) -> None:
    others = {path: model for path, model in healthy.models.items() if path != "imu"}
    without = replace(healthy, models=others)
    for before in (without, None):
        few = list(complaints(Trial(with_imu(healthy, 0.1)), before))
        assert few == ["imu was due 10 times a second, 100 by its period"]
        assert list(complaints(Trial(healthy), before)) == []


def test_a_period_that_was_made_longer_is_kept(healthy: Figures) -> None:
    slower = with_imu(healthy, 0.2, period_us=50_000.0)
    assert list(complaints(Trial(slower), healthy)) == []
    few = list(complaints(Trial(with_imu(healthy, 0.05, period_us=50_000.0)), healthy))
    assert few == ["imu was due 5 times a second, 20 by its period"]


def test_a_model_that_runs_by_events_may_rest(healthy: Figures) -> None:
    idle = replace(healthy.models["thrust_pairs"], run=0, reactions=0)
    resting = replace(healthy, models={**healthy.models, "thrust_pairs": idle})
    assert list(complaints(Trial(resting), healthy)) == []


def test_on_another_computer_timing_is_not_compared(healthy: Figures) -> None:
    conditions = healthy.conditions
    moved = replace(conditions, stated={**conditions.stated, "machine": "aarch64"})
    before = replace(healthy, conditions=moved)
    slower = replace(healthy, **step(healthy, 10.0, 3000.0))
    assert list(complaints(Trial(slower), before)) == []
    assert "machine" in (not_compared(slower, before) or "")
    assert list(complaints(Trial(slower), None)) == []


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
