"""`firmware_runtime.run`: a model alone, in any time."""

import os
import signal
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime import (
    MILLISECOND,
    NEVER,
    SECOND,
    ActivationPolicy,
    Atomic,
    ConfigError,
    Configuration,
    Coupled,
    Delay,
    ModelError,
    ModelFailure,
    PathDeadline,
    PortTypeError,
    RunState,
    ScaledClock,
    StatisticsFileError,
    VirtualClock,
    open_model,
    read_statistics,
    run,
    seconds,
)
from tests.support.command import in_python
from tests.support.periodic_models import PERIOD, Actuator, Robot, Sampler
from tests.support.stalling_clock import StallingClock


def virtual(model: Atomic | Robot, for_s: float | None = None, **choices: Any) -> Any:  # noqa: ANN401
    return run(model, for_s=for_s, clock="virtual", **choices)


def test_the_model_has_its_last_state_and_the_result_says_why_and_when() -> None:
    model = Sampler("sampler")
    result = virtual(model, 0.05)
    assert model.activations == 6
    assert (result.state, result.at, result.at_s) == (RunState.ENDED, 5 * PERIOD, 0.05)
    assert "0.050000000 s" in result.reason
    assert "statistics" not in repr(result)


def test_statistics_come_back_as_typed_objects() -> None:
    result = virtual(Robot(), 0.05)
    assert (result.statistics.scheduled, result.statistics.run) == (6, 6)
    assert result.statistics.models["imu"].run == 6


def test_virtual_time_without_a_length_ends_when_nothing_is_due() -> None:
    result = virtual(Actuator("thrust"))
    assert (result.state, result.at) == (RunState.ENDED, 0)


@pytest.mark.parametrize("clock", [VirtualClock(), StallingClock(dict.fromkeys(range(6), 1))])
def test_a_clock_of_ones_own_is_taken_as_it_is(clock: Any) -> None:  # noqa: ANN401
    model = Sampler("sampler")
    assert run(model, for_s=0.05, clock=clock).at == 5 * PERIOD
    assert model.activations == 6


@pytest.mark.real_time
def test_real_time_gives_the_values_of_virtual_time() -> None:
    robot = Robot()
    every = Configuration(policies={"imu": ActivationPolicy("catch-up")})
    result = run(robot, for_s=0.05, configuration=every)
    assert robot.thrust.received == [0, 1, 2, 3, 4, 5]
    assert result.at == 5 * PERIOD


def test_inputs_arrive_at_their_instants_whatever_their_order() -> None:
    model = Actuator("thrust")
    instants: list[tuple[int, int]] = []
    clock = VirtualClock()
    model.work = lambda value: instants.append((clock.now(), value))
    inputs = [(0.02, model.command, 2), (0.0, model.command, 1), (0.02, model.command, 3)]
    run(model, for_s=0.03, clock=clock, inputs=inputs)
    assert instants == [(0, 1), (2 * PERIOD, 2), (2 * PERIOD, 3)]


def test_what_leaves_a_port_at_any_level_can_be_listened_to() -> None:
    robot = Robot()
    received: list[tuple[int, int]] = []
    virtual(robot, 0.02, listen={robot.imu.sample: lambda at, value: received.append((at, value))})
    assert received == [(0, 0), (PERIOD, 1), (2 * PERIOD, 2)]


def test_a_statistics_file_can_be_read_by_others(tmp_path: Path) -> None:
    path = tmp_path / "sampler.stats"
    virtual(Sampler("sampler"), 0.05, statistics=str(path))
    assert read_statistics(path).state is RunState.ENDED


def test_a_bug_in_the_model_is_raised_with_its_path_and_instant() -> None:
    model = Sampler("sampler")
    model.work = lambda number: 1 // (2 - number)  # type: ignore[assignment]
    with pytest.raises(ModelFailure) as caught:
        virtual(model, 1.0)
    assert (caught.value.path, caught.value.at) == ("sampler", 2 * PERIOD)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


class Quitting(Sampler):
    exited = False

    def internal(self) -> None:
        raise SystemExit(0)

    def exit(self) -> None:
        self.exited = True


def test_a_model_that_quits_the_program_is_a_bug_too_and_the_run_ends_in_order() -> None:
    model = Quitting("quitting")
    with open_model(model, clock="virtual") as open_run:
        with pytest.raises(ModelError, match="SystemExit"):
            open_run.run(1.0)
        assert model.exited
        with pytest.raises(RuntimeError):
            open_run.run(1.0)


def test_models_exit_also_after_a_bug() -> None:
    robot = Robot()
    robot.imu.work = lambda number: 1 // (2 - number)  # type: ignore[assignment]
    with pytest.raises(ModelError):
        virtual(robot, 1.0)
    assert robot.thrust.exits == 1


def test_an_exit_that_fails_is_a_bug_of_the_model() -> None:
    class Clinging(Sampler):
        def exit(self) -> None:
            raise ValueError("no")

    with pytest.raises(ModelError, match="no"):
        virtual(Clinging("sampler"), 0.05)


@pytest.mark.parametrize(
    "choices",
    [
        {"for_s": -1},
        {"for_s": 0},
        {"for_s": float("nan")},
        {"for_s": float("inf")},
        {"for_s": "long"},
        {"for_s": True},
        {"clock": "virtuel"},
        {"clock": "scaled"},
        {"clock": "virtual", "speed": 2.0},
        {"clock": "scaled", "speed": -2.0},
        {"clock": VirtualClock(), "speed": 2.0},
        {"clock": 7},
        {"inputs": 3},
        {"inputs": [(1, 2)]},
        {"listen": [print]},
        {"listen": {"speed": 3}},
        {"statistics": 3},
        {"statistics": b"bytes"},
        {"configuration": Configuration},
        {"configuration": "fast"},
    ],
    ids=" ".join,
)
def test_a_choice_that_is_none_is_refused_before_anything_runs(choices: dict[str, Any]) -> None:
    model = Sampler("sampler")
    with pytest.raises(ConfigError):
        run(model, **{"for_s": 0.01, **choices})
    assert model.activations == 0


def test_the_longest_length_that_a_refusal_states_is_taken() -> None:
    with pytest.raises(ConfigError, match=r"1e\+09 at most"):
        virtual(Actuator("thrust"), 1.01e9)
    assert virtual(Actuator("thrust"), 1e9).at_s == 1e9


def test_what_is_no_model_is_refused() -> None:
    with pytest.raises(ConfigError):
        run(Sampler)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["sampler.recording", "", "a\0b"])
def test_statistics_go_into_a_file_of_their_own(tmp_path: Path, name: str) -> None:
    with pytest.raises(StatisticsFileError):
        virtual(Sampler("sampler"), 0.01, statistics=tmp_path / name)


def test_statistics_need_a_path_with_a_name() -> None:
    with pytest.raises(StatisticsFileError):
        virtual(Sampler("sampler"), 0.01, statistics=".")


def test_an_input_that_does_not_fit_is_refused_before_the_run() -> None:
    robot, model = Robot(), Actuator("thrust")
    with pytest.raises(PortTypeError):
        virtual(model, 0.01, inputs=[(0.0, model.command, "one")])
    with pytest.raises(ModelError):
        virtual(robot, 0.01, inputs=[(0.0, robot.thrust.command, 1)])
    with pytest.raises(ConfigError):
        virtual(model, 0.01, inputs=[(-1.0, model.command, 1)])


# In stretches -----------------------------------------------------------------------------------


def test_a_run_in_stretches_is_the_run_in_one() -> None:
    whole, parts = Robot(), Robot()
    at_once = virtual(whole, 0.05)
    with open_model(parts, clock="virtual") as opened:
        results = [opened.run(0.02), opened.run(0.03)]
    assert [each.at for each in results] == [2 * PERIOD, 5 * PERIOD]
    assert parts.thrust.received == whole.thrust.received
    assert results[-1].statistics.models == at_once.statistics.models


def test_nothing_exits_between_two_stretches() -> None:
    robot = Robot()
    with open_model(robot, clock="virtual") as opened:
        opened.run(0.02)
        assert robot.thrust.exits == 0
    assert robot.thrust.exits == 1


def test_a_run_that_is_over_does_not_go_on() -> None:
    with open_model(Sampler("sampler"), clock="virtual") as opened:
        opened.run(0.02)
    with pytest.raises(RuntimeError):
        opened.run(0.02)
    assert opened.close() is None


def test_a_run_says_of_itself_whether_it_can_go_on_and_how_far_it_has_come() -> None:
    with open_model(Sampler("sampler"), clock="virtual") as opened:
        opened.run(0.02)
        assert "sampler: open, at 0.02 s" in repr(opened)
    assert "sampler: over, at 0.02 s" in repr(opened)


def test_a_run_that_was_closed_before_it_began_does_not_begin() -> None:
    model = Sampler("sampler")
    opened = open_model(model, clock="virtual")
    assert opened.close() is None
    with pytest.raises(RuntimeError):
        opened.run(0.02)
    assert model.activations == 0


def test_a_request_to_stop_ends_the_run_with_its_reason() -> None:
    model = Sampler("sampler")
    with open_model(model, clock="virtual") as opened:
        model.work = lambda number: opened.request_stop("enough") if number == 3 else None
        result = opened.run(1.0)
        assert (result.state, result.reason, result.at) == (
            RunState.STOPPED,
            "enough",
            3 * PERIOD,
        )
        with pytest.raises(RuntimeError):
            opened.run(1.0)


@pytest.mark.real_time
def test_a_thread_puts_values_in_while_the_model_runs() -> None:
    model = Actuator("thrust")
    with open_model(model) as opened:
        model.work = lambda _value: opened.request_stop("received")
        posting = threading.Thread(target=opened.post, args=(model.command, 7))
        posting.start()
        result = opened.run(60.0)
        posting.join()
    assert (model.received, result.reason) == ([7], "received")


def test_a_value_that_does_not_fit_is_refused_where_it_is_posted() -> None:
    model = Actuator("thrust")
    with open_model(model, clock="virtual") as opened, pytest.raises(PortTypeError):
        opened.post(model.command, "seven")  # type: ignore[misc]


# Signals ----------------------------------------------------------------------------------------

PROGRAM = """
import os, signal
from firmware_runtime import run
from tests.support.periodic_models import Robot
robot = Robot()
robot.imu.work = lambda number: os.kill(os.getpid(), signal.{signal}) if number == 3 else None
try:
    print(run(robot, for_s={for_s}, clock="virtual").reason)
finally:
    print(robot.thrust.received, robot.thrust.exits)
"""


def signalled(name: str, for_s: float | None) -> subprocess.CompletedProcess[str]:
    program = PROGRAM.format(signal=name, for_s=for_s)
    return in_python(program)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_is_the_end_of_a_run_without_a_length(name: str) -> None:
    done = signalled(name, None)
    assert (done.returncode, done.stdout) == (0, f"{name}\n[0, 1, 2, 3] 1\n")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "status"), [("SIGINT", -signal.SIGINT), ("SIGTERM", 143)])
def test_a_signal_ends_a_run_with_a_length_in_order_and_then_the_program(
    name: str, status: int
) -> None:
    done = signalled(name, 1000.0)
    assert (done.returncode, done.stdout) == (status, "[0, 1, 2, 3] 1\n")


@pytest.mark.parametrize(
    ("number", "error"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit)]
)
def test_what_a_signal_raises_says_which_it_was(
    number: signal.Signals, error: type[BaseException]
) -> None:
    model = Sampler("sampler")
    model.work = lambda _number: os.kill(os.getpid(), number)
    with pytest.raises(error) as raised:
        virtual(model, 1000.0)
    assert raised.value.args == (() if number is signal.SIGINT else (143,))


def test_signals_are_as_they_were_after_a_run() -> None:
    before = signal.getsignal(signal.SIGINT)
    virtual(Sampler("sampler"), 0.01)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_model_runs_in_a_thread_too() -> None:
    model = Sampler("sampler")
    thread = threading.Thread(target=virtual, args=(model, 0.05))
    thread.start()
    thread.join()
    assert model.activations == 6


def test_never_is_no_length_of_seconds() -> None:
    with pytest.raises(ConfigError):
        virtual(Sampler("sampler"), NEVER / SECOND * 1000 * MILLISECOND)


def test_what_is_no_port_is_refused_to_speak_and_to_listen_at() -> None:
    with open_model(Coupled("root"), clock="virtual") as opened:
        with pytest.raises(ModelError, match="'speed'"):
            opened.post("speed", 1)  # type: ignore[arg-type]
        with pytest.raises(ModelError, match="'speed'"):
            opened.listen("speed", print)  # type: ignore[arg-type]


def test_a_run_within_a_run_is_refused() -> None:
    model = Sampler("sampler")
    with open_model(model, clock="virtual") as opened:

        def run_on(_at: int, _value: int) -> None:
            opened.run(1.0)

        opened.listen(model.sample, run_on)
        with pytest.raises(ModelFailure, match="under way"):
            opened.run(1.0)


def test_a_value_cannot_arrive_in_the_past() -> None:
    model = Actuator("thrust")
    with open_model(model, clock="virtual") as opened:
        opened.run(1.0)
        opened.plan(1.0, model.command, 1)
        with pytest.raises(ConfigError, match=r"0\.5: the run is at 1\.0"):
            opened.plan(0.5, model.command, 2)
        with pytest.raises(ModelError, match="command"):
            opened.plan(1.5, model.command, "ahead")  # type: ignore[misc]  # no number
        opened.run(1.0)
    assert model.received == [1]


@pytest.mark.parametrize(
    "make",
    [
        lambda: seconds(float("nan")),
        lambda: seconds("1"),  # type: ignore[arg-type]
        lambda: ScaledClock("2"),  # type: ignore[arg-type]
        lambda: ActivationPolicy("late"),  # type: ignore[arg-type]
        lambda: Configuration(policies={"imu": "skip"}),  # type: ignore[dict-item]
        lambda: Configuration(deadlines=["imu"]),  # type: ignore[list-item]
        lambda: PathDeadline("imu", Robot().imu.sample, Robot().imu, 0),
        lambda: PathDeadline("imu", None, None, 1),  # type: ignore[arg-type]
    ],
)
def test_a_setting_of_a_run_that_is_none_is_refused_where_it_is_made(
    make: Callable[[], object],
) -> None:
    with pytest.raises(ValueError, match="expected"):
        make()


@pytest.mark.parametrize("duration", [-1, 0.5, "1"])
def test_a_delay_is_whole_ns(duration: Any) -> None:  # noqa: ANN401
    with pytest.raises(ModelError, match="network"):
        Delay("network", int, duration)


def test_every_input_that_is_none_is_listed() -> None:
    with pytest.raises(ConfigError) as refused:
        virtual(Sampler("sampler"), 0.01, inputs=[(1, 2), "at once"])
    assert len(refused.value.faults) == 2


def test_a_listener_is_a_function() -> None:
    model = Sampler("sampler")
    with open_model(model, clock="virtual") as opened, pytest.raises(ModelError, match="None"):
        opened.listen(model.sample, None)  # type: ignore[arg-type]
