"""The experiment `circle` on a trace that is known."""

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from firmware_boards.tachobot.experiments import circle

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.senders import Senders
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.trial import Traced


def lines(off_m: float) -> Iterator[str]:
    """A body that goes round `off_m` too far outside, with the right yaw, for 44 s."""
    for n in range(0, 4400, 2):
        at = n * 10_000_000
        angle = math.tau * n / 2500
        values = {
            "controller.trajectory.x": {"position": math.cos(angle)},
            "controller.trajectory.y": {"position": math.sin(angle)},
            "controller.trajectory.yaw": {"position": 1.0},
            "world.x": {"position": (1 + off_m) * math.cos(angle), "rate": 0.3},
            "world.y": {"position": (1 + off_m) * math.sin(angle), "rate": 0.4},
            "world.yaw_rad": 1.0,
        }
        for port, value in values.items():
            yield json.dumps({"t_ns": at, "port": port, "value": value})
    yield json.dumps({"t_ns": 5, "port": "controller.watch.state", "value": "TRACKING"})


@pytest.mark.slow
def test_errors_are_setpoint_less_truth_and_the_last_run_is_meant_to_fail(tmp_path: Path) -> None:
    trace = tmp_path / "trace.jsonl"
    trace.write_text("\n".join(lines(0.05)))

    @contextmanager
    def run(_stage: object, *, label: str, **_rest: object) -> Iterator[Traced]:
        if label == "given-up":
            raise ConfigError("run", ["no position for 6 s"])
        yield Traced({"statistics": {}}, trace, None, Senders(Coupled("robot")))

    trial: Any = SimpleNamespace(run=run, say=lambda _: None)
    findings = circle.run(trial)
    assert findings.ours["off_rms_mm"] == pytest.approx(50.0)
    assert findings.ours["off_largest_mm"] == pytest.approx(50.0)
    assert findings.ours["yaw_largest_mrad"] == 0.0
    cases: dict[str, circle.Case] = findings.details["cases"]
    assert set(cases) == set(circle.CASES)
    first = cases["20 Hz, 0.05 s"]
    assert first.x.rms == pytest.approx(0.05 / math.sqrt(2), rel=0.1)
    assert first.speed_at_end_m_s == pytest.approx(0.5)
    assert first.states == ["TRACKING"]
    assert "no position for 6 s" in findings.sentences[-1]
    assert set(findings.plots) == {"path", "errors", "stopped-path", "stopped-errors"}
    assert len(list(findings.data[""])) == 1 + len(circle.CASES) * 1300
