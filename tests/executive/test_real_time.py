"""The same runs on the real clock: identities and order, never times."""

from pathlib import Path

import pytest

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.clocks import Clock, MonotonicClock, ScaledClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.statistics.file_header import RunState
from tests.support.executives import Run
from tests.support.periodic_models import Robot

pytestmark = pytest.mark.real_time
UNTIL = 60 * MILLISECOND


def trace(clock: Clock) -> list[tuple[int, object]]:
    robot = Robot(imu=2 * MILLISECOND)
    policies = {"imu": ActivationPolicy("catch-up")}
    run = Run(robot, clock, Configuration(policies=policies))
    sent: list[tuple[int, object]] = []
    run.executive.simulator.listen(robot.imu.sample, lambda at, value: sent.append((at, value)))
    assert run.until(UNTIL).state is RunState.ENDED
    return sent


@pytest.mark.parametrize("clock", [MonotonicClock(), ScaledClock(3)], ids=["real", "scaled"])
def test_its_trace_is_the_trace_in_virtual_time(clock: Clock) -> None:
    assert trace(clock) == trace(VirtualClock())


@pytest.mark.parametrize("settings", [ProcessSettings(), ProcessSettings(freeze_garbage=True)])
def test_every_activation_is_accounted_for(tmp_path: Path, settings: ProcessSettings) -> None:
    robot = Robot(imu=MILLISECOND, compass=3 * MILLISECOND)
    configuration = Configuration(process=settings, statistics_path=tmp_path / "robot.stats")
    run = Run(robot, MonotonicClock(), configuration)
    run.until(UNTIL)
    scheduled, executed, skipped, coalesced = run.counts()
    assert scheduled == executed + skipped + coalesced == 61 + 21
    assert executed == robot.imu.activations + robot.compass.activations
    assert coalesced == 0


def test_nothing_starts_before_its_deadline() -> None:
    robot = Robot(imu=2 * MILLISECOND)
    clock = MonotonicClock()
    run = Run(robot, clock)
    early: list[int] = []

    def work(_number: int) -> None:
        if clock.now() < run.executive.simulator.now:
            early.append(run.executive.simulator.now)

    robot.imu.work = work
    run.until(UNTIL)
    assert robot.imu.activations > 0
    assert early == []
