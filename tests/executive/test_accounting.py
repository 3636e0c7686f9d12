"""What becomes of activations: counts against arithmetic, on a clock whose stalls are arranged."""

from functools import partial

import numpy as np
import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.statistics.file_header import RunState
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot, Sampler
from tests.support.stalling_clock import StallingClock

CATCH_UP = {"imu": ActivationPolicy("catch-up")}


def test_on_time_everything_runs() -> None:
    run = Run(Robot(), VirtualClock())
    run.until(SECOND)
    assert run.counts("imu") == run.counts() == (101, 101, 0, 0)
    assert run.model("imu")["overruns"] == run.model("imu")["episodes"] == 0


class NumpySampler(Sampler):
    """Plans in whole numbers of numpy's; half way through its period it is in another phase."""

    def internal(self) -> None:
        super().internal()
        self.sigma = np.int64(PERIOD // 2)  # type: ignore[assignment]

    def external(self, elapsed: int) -> None:
        super().external(elapsed)
        self.sigma = np.int64(self.sigma)  # type: ignore[assignment]


class PlainSampler(Sampler):
    """The same in plain ones."""

    def internal(self) -> None:
        super().internal()
        self.sigma = PERIOD // 2


@pytest.mark.parametrize("period", [PERIOD, NEVER])
def test_models_that_plan_in_numbers_of_numpy_are_counted_as_any(period: int) -> None:
    received = []
    for kind in (NumpySampler, PlainSampler):
        sampler, root = kind("sampler"), Coupled("robot")
        sampler.period = period
        root.add(sampler)
        inlet = root.in_port("in", int)
        root.couple(inlet, sampler.replan)
        clock = StallingClock({9: 35 * MILLISECOND})
        run = Run(root, clock)
        for at in (3, 7, 8):
            clock.at(
                at * PERIOD + MILLISECOND, partial(run.executive.inbox.post, inlet, 3 * MILLISECOND)
            )
        run.until(SECOND)
        received.append(run.json()["models"]["sampler"])
    assert received[0] == received[1]
    assert received[0]["run"] > 80


def test_after_half_a_second_of_stall_one_late_activation_runs_and_49_are_skipped() -> None:
    robot = Robot()
    run = Run(robot, StallingClock({10: 500 * MILLISECOND}))
    run.until(SECOND)
    imu = run.model("imu")
    assert run.counts("imu") == (101, 52, 49, 0)
    assert imu["overruns"] == imu["episodes"] == 1
    assert imu["lateness_us"]["max"] == 500_000
    assert imu["last_late_t_ns"] == 100 * MILLISECOND
    assert robot.imu.activations == 52


def test_a_deadline_at_the_very_end_of_the_stall_is_on_time() -> None:
    for stall, skipped in ((PERIOD - 1, 0), (PERIOD, 0), (PERIOD + 1, 1), (2 * PERIOD, 1)):
        run = Run(Robot(), StallingClock({10: stall}))
        run.until(SECOND)
        assert run.counts("imu") == (101, 101 - skipped, skipped, 0)


def test_catching_up_runs_every_missed_activation() -> None:
    run = Run(Robot(), StallingClock({10: 500 * MILLISECOND}), Configuration(policies=CATCH_UP))
    run.until(SECOND)
    imu = run.model("imu")
    assert run.counts("imu") == (101, 101, 0, 0)
    assert imu["overruns"] == 50  # 500 ms late down to 10 ms late; the next one is on time
    assert imu["episodes"] == 1


def test_two_stalls_are_two_episodes_unless_nothing_was_on_time_in_between() -> None:
    apart = Run(Robot(), StallingClock({10: 30 * MILLISECOND, 12: 30 * MILLISECOND}))
    apart.until(SECOND)
    joined = Run(Robot(), StallingClock({10: 30 * MILLISECOND, 11: 30 * MILLISECOND}))
    joined.until(SECOND)
    assert apart.counts() == joined.counts() == (101, 97, 4, 0)
    assert apart.model("imu")["episodes"] == 2
    assert joined.model("imu")["episodes"] == 1


def test_a_step_longer_than_the_period_skips_without_ever_being_late() -> None:
    robot, clock = Robot(), StallingClock()
    robot.imu.work = lambda _number: clock.spend(PERIOD + 1)
    run = Run(robot, clock)
    run.until(SECOND)
    imu = run.model("imu")
    assert run.counts("imu") == (101, 51, 50, 0)
    assert (imu["overruns"], imu["episodes"]) == (0, 50)
    assert imu["step_us"]["max"] == run.json()["step_us"]["max"] == 10_000.001


def test_lateness_within_the_tolerance_is_measured_and_is_no_overrun() -> None:
    for tolerance_us, late_ns, overruns in (
        (None, 1_000_000, 0),
        (None, 1_000_001, 1),
        (1.5, 1_501, 1),
    ):
        policies = {"imu": ActivationPolicy(tolerance_us=tolerance_us)}
        run = Run(Robot(), StallingClock({5: late_ns}), Configuration(policies=policies))
        run.until(SECOND)
        assert run.model("imu")["overruns"] == overruns
        assert run.model("imu")["lateness_us"]["max"] == late_ns / 1000


def test_each_model_has_its_own_account_and_totals_are_their_sums() -> None:
    robot = Robot(imu=PERIOD, compass=25 * MILLISECOND)
    run = Run(robot, StallingClock({10: 100 * MILLISECOND}))
    run.until(SECOND)
    imu, compass = run.counts("imu"), run.counts("compass")
    assert imu[0] == 101
    assert compass[0] == 41
    assert run.counts() == tuple(a + b for a, b in zip(imu, compass, strict=True))
    assert imu[2] > compass[2] > 0


def test_each_model_runs_once_late_and_skips_only_after_that() -> None:
    robot = Robot(imu=PERIOD, compass=PERIOD)
    robot.compass.offset = 5 * MILLISECOND
    run = Run(robot, StallingClock({20: 100 * MILLISECOND}))  # at 100 ms, until 200 ms
    run.until(300 * MILLISECOND)
    imu, compass = run.model("imu"), run.model("compass")
    assert run.counts("imu") == (31, 22, 9, 0)
    assert run.counts("compass") == (30, 21, 9, 0)
    assert imu["last_late_t_ns"] == 100 * MILLISECOND
    assert compass["last_late_t_ns"] == 105 * MILLISECOND
    assert imu["overruns"] == compass["overruns"] == 1


def test_an_input_that_replans_a_model_before_its_deadline_is_no_activation_at_all() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    clock.at(5 * MILLISECOND, lambda: run.executive.inbox.post(robot.replan, PERIOD))
    run.until(45 * MILLISECOND)
    assert run.counts("imu") == (5, 5, 0, 0)
    assert robot.imu.activations == 5


def replanned_while_busy(policy: str) -> tuple[Run, Robot]:
    """From 3 ms to 18 ms the actuator is busy; at 5 ms an input moves the IMU from 10 to 25 ms."""
    robot, clock = Robot(), StallingClock()
    policies = {"imu": ActivationPolicy(policy)}  # type: ignore[arg-type]
    run = Run(robot, clock, Configuration(policies=policies))
    inbox = run.executive.inbox
    robot.thrust.work = lambda value: clock.spend(15 * MILLISECOND) if value == 77 else None
    clock.at(3 * MILLISECOND, lambda: inbox.post(robot.command, 77))
    clock.at(5 * MILLISECOND, lambda: inbox.post(robot.replan, 20 * MILLISECOND))
    run.until(50 * MILLISECOND)
    return run, robot


@pytest.mark.parametrize("policy", ["skip", "catch-up"])
def test_an_input_that_replans_an_activation_already_due_coalesces_it(policy: str) -> None:
    run, robot = replanned_while_busy(policy)
    assert run.counts("imu") == (5, 4, 0, 1)  # at 0, (10,) 25, 35, 45 ms
    assert robot.imu.activations == 4
    assert run.model("imu")["overruns"] == run.model("imu")["episodes"] == 0


@pytest.mark.parametrize(("busy_for", "coalesced"), [(0, 0), (7 * MILLISECOND, 1)])
def test_an_input_that_moves_an_activation_forward_coalesces_it_if_its_deadline_has_come(
    busy_for: int, coalesced: int
) -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    inbox = run.executive.inbox
    robot.thrust.work = lambda value: clock.spend(busy_for) if value == 77 else None
    clock.at(3 * MILLISECOND, lambda: inbox.post(robot.command, 77))
    clock.at(5 * MILLISECOND, lambda: inbox.post(robot.replan, 3 * MILLISECOND))
    run.until(2 * PERIOD)
    assert run.counts("imu") == (3 + coalesced, 3, 0, coalesced)  # at 0, 8, (10,) 18 ms


def test_an_input_that_leaves_the_booking_alone_coalesces_nothing() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    inbox = run.executive.inbox
    robot.thrust.work = lambda value: clock.spend(15 * MILLISECOND) if value == 77 else None
    clock.at(2 * MILLISECOND, lambda: inbox.post(robot.command, 77))
    clock.at(3 * MILLISECOND, lambda: inbox.post(robot.replan, -1))
    run.until(PERIOD)
    assert run.counts("imu") == (2, 2, 0, 0)
    assert run.model("imu")["lateness_us"]["max"] == 7_000


def test_after_a_skip_an_input_finds_what_is_left_up_to_the_new_deadline() -> None:
    robot, clock = Robot(), StallingClock({1: 35 * MILLISECOND})
    run = Run(robot, clock)
    clock.at(47 * MILLISECOND, lambda: run.executive.inbox.post(robot.replan, -1))
    run.until(60 * MILLISECOND)
    assert robot.imu.left == [3 * MILLISECOND]
    assert run.counts("imu") == (7, 4, 3, 0)  # skipped at 20, 30 and 40 ms


def test_a_zero_time_continuation_belongs_to_the_activation_it_follows() -> None:
    class TwoPhases(Sampler):
        """Reads in one transition, sends in the next, at the same instant."""

        def internal(self) -> None:
            if self.phase == "waiting":
                self.activate("sending")
            else:
                super().internal()

    sampler = TwoPhases("imu")
    run = Run(sampler, VirtualClock())
    run.until(SECOND)
    assert sampler.activations == 101
    assert run.counts("imu") == (101, 101, 0, 0)


def test_a_confluent_activation_has_run() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    clock.at(PERIOD, lambda: run.executive.inbox.post(robot.replan, 5 * MILLISECOND))
    run.until(2 * PERIOD)
    assert run.counts("imu") == (3, 3, 0, 0)  # at 0, 10 and 15 ms


def test_every_model_has_an_account() -> None:
    run = Run(Robot(), VirtualClock())
    run.until(PERIOD)
    models = run.json()["models"]
    assert {path: model["kind"] for path, model in models.items()} == {
        "imu": "periodic",
        "thrust": "event",
    }
    assert models["imu"]["period_us"] == PERIOD / MICROSECOND
    assert models["thrust"]["period_us"] is models["thrust"]["policy"] is None


def test_what_is_due_when_the_run_is_stopped_counts_as_skipped() -> None:
    robot = Robot(imu=PERIOD, compass=PERIOD)
    policies = {"imu": ActivationPolicy("stop", stop_after_us=30_000)}
    run = Run(robot, StallingClock({10: 45 * MILLISECOND}), Configuration(policies=policies))
    run.until(SECOND)
    # ten activations each, then those at 100, 110, 120, 130 and 140 ms
    assert run.counts("imu") == run.counts("compass") == (15, 10, 5, 0)


@pytest.mark.parametrize(("beyond", "state"), [(0, RunState.ENDED), (1, RunState.OVERRUN)])
def test_an_activation_just_as_late_as_its_policy_allows_stops_no_run(
    beyond: int, state: RunState
) -> None:
    policies = {"imu": ActivationPolicy("stop", stop_after_us=30_000)}
    clock = StallingClock({10: 30 * MILLISECOND + beyond})
    assert Run(Robot(), clock, Configuration(policies=policies)).until(SECOND).state is state


def test_an_activation_that_begins_too_late_within_its_step_stops_the_run_too() -> None:
    robot, clock = Robot(imu=PERIOD, compass=PERIOD), StallingClock()
    policies = {"compass": ActivationPolicy("stop", stop_after_us=100)}
    run = Run(robot, clock, Configuration(policies=policies))
    run.executive.simulator.listen(
        robot.imu.sample, lambda _at, number: clock.spend(200_000) if number == 3 else None
    )
    assert run.until(SECOND).reason.startswith("compass: an activation was 200 us late")
    assert run.counts("compass") == (4, 4, 0, 0)


def test_an_activation_whose_model_raises_has_not_run() -> None:
    robot = Robot(imu=PERIOD, compass=PERIOD)

    def work(number: int) -> None:
        if number == 3:
            raise ValueError

    robot.compass.work = work
    run = Run(robot, VirtualClock())
    run.until(SECOND)
    assert run.counts("imu") == (4, 4, 0, 0)
    assert run.counts("compass") == (4, 3, 1, 0)
