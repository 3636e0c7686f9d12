"""Whatever ends a run, outputs are made safe once; a pause ends nothing."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from time import process_time_ns
from typing import NoReturn, cast

import pytest

from firmware_runtime.devs.model_errors import ModelError, ModelFailure
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError
from firmware_runtime.executive.clocks import MonotonicClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import PathDeadline
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.ledger import CpuTime
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.statistics import file_header
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import HEARTBEAT, STATE
from firmware_runtime.statistics.reader import read_statistics
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Actuator, Robot
from tests.support.stalling_clock import StallingClock


def raising(error: BaseException, at: int = 2) -> Callable[[int], None]:
    def work(number: int) -> None:
        if number == at:
            raise error

    return work


def test_the_end_asked_for() -> None:
    robot = Robot()
    run = Run(robot, VirtualClock())
    outcome = run.until(PERIOD)
    assert (outcome.state, outcome.error, outcome.faults) == (RunState.ENDED, None, ())
    assert (run.made_safe, robot.thrust.exits) == (2, 1)
    assert run.json()["conditions"]["run"]["state"] == "ended"


def test_a_stop_request_ends_the_run_after_the_step_under_way() -> None:
    robot = Robot()
    run = Run(robot, VirtualClock())
    robot.imu.work = lambda number: run.executive.request_stop("SIGTERM") if number == 2 else None
    outcome = run.until()
    assert (outcome.state, outcome.reason) == (RunState.STOPPED, "SIGTERM")
    assert run.executive.stopped_by == "SIGTERM"
    assert robot.thrust.received == [0, 1, 2]
    assert (run.made_safe, robot.thrust.exits) == (2, 1)


def test_the_first_reason_to_stop_is_kept() -> None:
    run = Run(Robot(), VirtualClock())
    run.executive.request_stop("SIGTERM")
    run.executive.request_stop("SIGINT")
    assert run.until().reason == "SIGTERM"


def test_what_a_supervisor_ended_for_an_overrun_was_not_asked_to_stop() -> None:
    run = Run(Robot(), VirtualClock())
    run.executive.request_stop("the loop hung", RunState.OVERRUN)
    assert run.until().state is RunState.OVERRUN
    assert run.executive.stopped_by is None


def test_an_exception_in_a_model() -> None:
    robot = Robot()
    robot.imu.work = raising(ZeroDivisionError("by zero"))
    run = Run(robot, VirtualClock())
    outcome = run.until()
    assert outcome.state is RunState.FAILED
    assert isinstance(outcome.error, ModelFailure)
    assert outcome.reason == (
        "robot.imu at 0.020000000 s: raised ZeroDivisionError in phase 'waiting': by zero"
    )
    assert re.fullmatch(rf"{re.escape(outcome.reason)} \(.*\.py, line \d+\)", outcome.sentence)
    assert (run.made_safe, robot.thrust.exits) == (2, 1)
    assert run.json()["conditions"]["run"]["state"] == "failed"


def test_the_reason_is_one_line_whatever_a_model_says() -> None:
    robot = Robot()
    robot.imu.work = raising(ValueError("no fit:\n\n  chi2 = 9\r\n\tdegrees = 3\n"))
    run = Run(robot, VirtualClock())
    outcome = run.until()
    assert outcome.reason.endswith(": no fit: chi2 = 9 degrees = 3")
    assert run.json()["conditions"]["run"]["reason"] == outcome.reason


def test_a_reason_that_utf_8_has_no_word_for_ends_the_run_as_any_other() -> None:
    robot = Robot()
    file = os.fsdecode(b"caf\xe9.csv")
    robot.imu.work = raising(ValueError(f"no column in {file}"))
    run = Run(robot, VirtualClock())
    outcome = run.until()
    assert outcome.state == RunState.FAILED
    assert outcome.reason.endswith("no column in caf\\udce9.csv")
    assert run.made_safe == 2
    assert run.json()["conditions"]["run"]["reason"] == outcome.reason


def test_the_reason_keeps_a_line_for_each_fault_of_a_setting() -> None:
    outcome = Outcome.of_error(ConfigError("board.toml", ["a: 1", "b: 2"]))
    assert outcome.reason.splitlines() == ["board.toml: 2 faults", "  - a: 1", "  - b: 2"]


def test_an_input_of_the_wrong_type() -> None:
    robot = Robot()
    run = Run(robot, VirtualClock())
    run.executive.inbox.post(robot.command, cast("int", "full ahead"))
    outcome = run.until()
    assert outcome.state is RunState.FAILED
    assert isinstance(outcome.error, ModelError)
    assert run.made_safe == 2


def test_ctrl_c_without_a_signal_handler_of_ours() -> None:
    robot = Robot()
    robot.imu.work = raising(KeyboardInterrupt())
    run = Run(robot, VirtualClock())
    outcome = run.until()
    assert (outcome.state, outcome.reason) == (RunState.STOPPED, "SIGINT")
    assert (run.made_safe, robot.thrust.exits) == (2, 1)


def test_an_exit_of_the_interpreter_goes_on_once_outputs_are_safe() -> None:
    robot = Robot()
    robot.imu.work = raising(SystemExit(4))
    run = Run(robot, VirtualClock())
    with pytest.raises(SystemExit):
        run.until()
    assert (run.made_safe, robot.thrust.exits) == (2, 1)


def test_a_policy_that_stops() -> None:
    robot = Robot()
    policies = {"imu": ActivationPolicy("stop", stop_after_us=2_000)}
    run = Run(robot, StallingClock({3: 2_500_000}), Configuration(policies=policies))
    outcome = run.until()
    assert outcome.state is RunState.OVERRUN
    assert outcome.reason == (
        "imu: an activation was 2500 us late; its policy stops the run over 2000 us"
    )
    assert robot.thrust.received == [0, 1, 2]
    assert run.made_safe == 2
    assert run.json()["conditions"]["run"]["state"] == "overrun"


def test_a_policy_that_stops_does_not_judge_what_is_due_after_the_end() -> None:
    policies = {"imu": ActivationPolicy("stop", stop_after_us=2_000)}
    run = Run(Robot(), StallingClock({3: 2 * PERIOD}), Configuration(policies=policies))
    assert run.until(PERIOD * 5 // 2).state is RunState.ENDED


@pytest.mark.parametrize("failure", [OSError("bus gone"), KeyboardInterrupt(), SystemExit()])
def test_what_goes_wrong_in_making_safe_is_reported_and_models_still_exit(
    failure: BaseException,
) -> None:
    def make_safe() -> NoReturn:
        raise failure

    thrust = Actuator("thrust")
    outcome = Executive(thrust, VirtualClock(), make_safe).run(PERIOD)
    assert outcome.faults[0] == f"make_safe raised {type(failure).__name__}: {failure}"
    assert thrust.exits == 1


@pytest.mark.parametrize("failure", [None, SystemExit(3), KeyboardInterrupt(), GeneratorExit()])
def test_what_an_exit_switches_on_is_switched_off_again(failure: BaseException | None) -> None:
    done: list[str] = []

    def make_safe() -> list[str]:
        done.append("off")
        return []

    class Parking(Actuator):
        def exit(self) -> None:
            done.append("on")
            if failure is not None:
                raise failure

    executive = Executive(Parking("thrust"), VirtualClock(), make_safe)
    assert len(executive.run(PERIOD).faults) == (failure is not None)
    assert done == ["off", "on", "off"]
    assert executive.cells[STATE] == RunState.ENDED


def test_what_could_not_be_made_safe_is_in_the_outcome() -> None:
    executive = Executive(Robot(), VirtualClock(), lambda: ["i2c1 0x40: no acknowledge"])
    assert executive.run(PERIOD).faults[0] == "i2c1 0x40: no acknowledge"


def test_what_a_model_raises_in_exit_is_in_the_outcome() -> None:
    class Stubborn(Actuator):
        def exit(self) -> None:
            raise OSError("line held")

    outcome = Run(Stubborn("thrust"), VirtualClock()).until(PERIOD)
    assert outcome.state is RunState.ENDED
    assert len(outcome.faults) == 1
    assert "line held" in outcome.faults[0]


def test_statistics_that_cannot_be_written_refuse_the_run(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    robot = Robot()
    path = tmp_path / "file" / "robot.stats"
    run = Run(robot, VirtualClock(), Configuration(statistics_path=path))
    outcome = run.until(PERIOD)
    assert outcome.state is RunState.FAILED
    assert isinstance(outcome.error, StatisticsFileError)
    assert robot.thrust.received == []
    assert run.made_safe == 2


def test_all_names_that_are_not_in_the_model_are_refused_at_once() -> None:
    robot, other = Robot(), Robot()
    configuration = Configuration(
        policies={
            "imu": ActivationPolicy(),
            "thrust": ActivationPolicy(),
            "yaw": ActivationPolicy(),
        },
        deadlines=[PathDeadline("yaw", robot.imu.sample, other.thrust, 1)],
    )
    with pytest.raises(ConfigError) as refusal:
        Run(robot, VirtualClock(), configuration)
    assert refusal.value.faults == (
        "policy of thrust: no periodic model has this path",
        "policy of yaw: no periodic model has this path",
        "deadline yaw: robot.thrust is not of an atomic model of this robot",
    )


def test_outputs_are_made_safe_at_the_end_only() -> None:
    run = Run(Robot(), VirtualClock())
    run.executive.run_on(2 * PERIOD)
    assert (run.made_safe, run.executive.is_over) == (0, False)
    ended = run.executive.end()
    assert ended is not None
    assert ended.state is RunState.ENDED
    assert (run.made_safe, run.executive.is_over) == (2, True)


def test_ending_what_is_over_or_never_began_does_nothing() -> None:
    run = Run(Robot(), VirtualClock())
    assert run.executive.end() is None
    run.until(PERIOD)
    assert run.executive.end() is None
    assert run.made_safe == 2


def test_a_run_that_was_stopped_has_ended_and_does_not_go_on() -> None:
    robot = Robot()
    run = Run(robot, VirtualClock())
    robot.imu.work = lambda _number: run.executive.request_stop("enough")
    assert run.executive.run_on(2 * PERIOD).state is RunState.STOPPED
    assert run.made_safe == 2
    with pytest.raises(RuntimeError):
        run.executive.run_on(3 * PERIOD)


def test_time_that_passes_in_a_pause_is_none_of_the_run() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    run.executive.run_on(2 * PERIOD)
    clock.instant += SECOND
    run.executive.run_on(4 * PERIOD)
    clock.instant += SECOND
    run.executive.end()
    assert robot.thrust.received == [0, 1, 2, 3, 4]
    assert run.counts("imu") == (5, 5, 0, 0)
    assert run.executive.reached == 4 * PERIOD


def test_processor_time_in_a_pause_is_none_of_the_run() -> None:
    cpu = CpuTime(MonotonicClock())
    cpu.pause()
    until = process_time_ns() + 5 * MILLISECOND
    while process_time_ns() < until:
        pass
    cpu.go_on()
    assert cpu.spent() < 5 * MILLISECOND


def test_nothing_falls_due_in_a_pause(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "robot.stats"
    run = Run(Robot(), StallingClock(), Configuration(statistics_path=path))
    run.executive.run_on(2 * PERIOD)
    monkeypatch.setattr(file_header, "monotonic_ns", lambda: NEVER // 2)
    assert read_statistics(path).figures().scheduled == run.executive.statistics.figures().run
    assert run.executive.cells[HEARTBEAT] == 0


def test_virtual_time_that_has_nothing_to_wait_for_goes_on_with_an_input() -> None:
    model = Actuator("thrust")
    executive = Executive(model, VirtualClock())
    executive.run_on(NEVER)
    executive.plan(SECOND, model.command, 1)
    executive.run_on(NEVER)
    assert (model.received, executive.reached) == ([1], SECOND)


def test_what_is_planned_comes_before_what_arrives_at_the_same_instant() -> None:
    model, clock = Actuator("thrust"), StallingClock()
    executive = Executive(model, clock)
    clock.at(PERIOD, lambda: executive.inbox.post(model.command, 2))
    executive.plan(PERIOD, model.command, 1)
    executive.plan(2 * PERIOD, model.command, 3)
    executive.run(3 * PERIOD)
    assert model.received == [1, 2, 3]


def test_an_instant_that_has_passed_is_now() -> None:
    model = Actuator("thrust")
    executive = Executive(model, VirtualClock())
    executive.run_on(2 * PERIOD)
    executive.plan(PERIOD, model.command, 1)
    executive.run_on(3 * PERIOD)
    assert model.received == [1]
