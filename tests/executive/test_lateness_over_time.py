"""What a run keeps of its lateness: by the second, of several models, within an episode."""

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock


def test_a_step_that_ends_with_the_second_belongs_to_the_next_and_the_last_span_is_kept() -> None:
    run = Run(Robot(), VirtualClock())
    run.until(5 * SECOND // 2)
    spans = run.executive.statistics.timeline
    assert [(span.begin_ns, span.activations) for span in spans] == [
        (0, 100),
        (SECOND, 100),
        (2 * SECOND, 51),
    ]
    assert sum(span.activations for span in spans) == run.json()["run"]


def test_of_several_late_models_the_latest_counts() -> None:
    """Both are due at once and wake 1 ms late; the first takes 3 ms before the second begins."""
    robot, clock = Robot(imu=PERIOD, compass=PERIOD), StallingClock({2: MILLISECOND})
    run = Run(robot, clock)

    def receive(_at: int, number: int) -> None:
        clock.spend(3 * MILLISECOND if number == 2 else 0)

    run.executive.simulator.listen(robot.imu.sample, receive)
    run.until(3 * PERIOD)
    worst = run.json()["worst"][0]
    assert (worst["model"], worst["t_ns"], worst["lateness_us"]) == ("compass", 2 * PERIOD, 4000)
    (span,) = run.executive.statistics.timeline
    assert span.lateness_max_ns == 4 * MILLISECOND


def test_an_episode_keeps_its_latest_activation_not_the_last_or_the_least() -> None:
    """One stall of 35 ms, caught up with: late by 35, 25, 15 and 5 ms, then on time."""
    robot, clock = Robot(), StallingClock({2: 35 * MILLISECOND})
    policies = {"imu": ActivationPolicy("catch-up")}
    run = Run(robot, clock, Configuration(policies=policies))
    run.until(20 * PERIOD)
    (account,) = (each for each in run.executive.accounts if each.path == "imu")
    assert (account.overruns, account.episodes, account.in_episode) == (4, 1, False)
    assert account.latest_in_episode == 35 * MILLISECOND
