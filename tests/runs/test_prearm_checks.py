"""What speaks against arming: of a loop that is late, what endangers control and nothing else."""

from collections.abc import Mapping

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.runs.prearm_checks import prearm_checks
from tests.support.periodic_models import PERIOD, Robot, Sampler
from tests.support.stalling_clock import StallingClock

TENTH = SECOND // 10
ASKED_AT = 6 * SECOND


class Beacon(Atomic):
    """Has an event every 10 ms, and states no period."""

    def initialize(self) -> None:
        self.hold_in("waiting", PERIOD)

    def internal(self) -> None:
        self.hold_in("waiting", PERIOD)


class Run:
    """A run of six seconds; `against` is what spoke against arming it then."""

    def __init__(
        self,
        clock: Clock,
        model: Component | None = None,
        *,
        policies: Mapping[str, ActivationPolicy] | None = None,
        max_late_percent: float = 1,
        asked_at: int = ASKED_AT,
    ) -> None:
        configuration = Configuration(policies=policies or {}, max_lag=asked_at)
        self.against: list[str] = []
        self._asked_at = asked_at
        self._executive = Executive(model or Robot(), clock, list, configuration)
        self._executive.hooks.append(self)
        self._checks = prearm_checks(self._executive, max_late_percent)
        self._executive.run(asked_at + TENTH)

    def between_steps(self, now: int, _left: int) -> None:
        """Ask once, as `firmware-runtime arm` does."""
        if now >= self._asked_at:
            self._asked_at = 2 * ASKED_AT
            self.against = [why for ask in self._checks if (why := ask(now)) is not None]

    @property
    def overruns(self) -> int:
        return sum(account.overruns for account in self._executive.accounts)


def test_a_loop_that_has_not_run_for_a_second_fails_the_check() -> None:
    run = Run(VirtualClock(), asked_at=SECOND - TENTH)
    assert run.against == ["the rate has not been measured for a second yet"]


def test_a_loop_that_keeps_its_time_is_none() -> None:
    assert Run(VirtualClock(), asked_at=SECOND).against == []
    assert Run(VirtualClock()).against == []


def test_a_model_slower_than_a_second_passes_while_it_waits() -> None:
    assert Run(VirtualClock(), Robot(imu=3 * SECOND)).against == []


def test_a_model_without_a_period_demands_none() -> None:
    assert Run(VirtualClock(), Coupled("nothing")).against == []


def test_activations_late_by_a_tenth_of_a_period_now_and_then_are_none() -> None:
    """As on a machine whose host wakes it late once in a while: it could never be armed before."""
    late = dict.fromkeys(range(60, 600, 110), 2 * MILLISECOND)
    run = Run(StallingClock(late))
    assert run.overruns == len(late)
    assert run.against == []


def test_more_late_activations_than_the_board_allows_are_one() -> None:
    late = dict.fromkeys(range(300, 312), 2 * MILLISECOND)
    (why,) = Run(StallingClock(late)).against
    assert "2.40 % of the activations" in why
    assert "2.0 ms late" in why
    assert "at most 1 %" in why
    assert "later than a period (10 ms)" in why
    assert Run(StallingClock(late), max_late_percent=3).against == []


def test_what_was_late_more_than_five_seconds_ago_is_forgotten() -> None:
    late = dict.fromkeys(range(20), 15 * MILLISECOND)
    assert Run(StallingClock(late), asked_at=5 * SECOND).against != []
    assert Run(StallingClock(late)).against == []


@pytest.mark.parametrize("wait", [100, 550, 599], ids=["oldest", "whole", "under way"])
def test_one_activation_later_than_a_period_is_one_in_any_span(wait: int) -> None:
    late = {wait: 11 * MILLISECOND}
    (why,) = Run(StallingClock(late)).against
    assert "11.0 ms late" in why
    assert Run(StallingClock(late), max_late_percent=99).against != []


def test_an_activation_late_by_a_whole_period_is_not_later_than_it() -> None:
    assert Run(StallingClock({550: PERIOD})).against == []


def test_skipped_activations_count_as_late() -> None:
    """A step now and then takes longer than a period: nothing is late, and the next is skipped."""
    clock, robot = StallingClock(), Robot()
    robot.imu.work = lambda number: clock.spend((number % 40 == 0) * 11 * MILLISECOND)
    run = Run(clock, robot)
    assert run.overruns == 0
    (why,) = run.against
    assert "late or skipped, the latest came 0.0 ms late" in why


def test_a_loop_that_falls_behind_what_is_due_is_one() -> None:
    """Nothing is skipped by this policy: the clock goes on, and what is due waits."""
    clock, robot = StallingClock(), Robot()
    robot.imu.work = lambda _number: clock.spend(20 * MILLISECOND)
    run = Run(clock, robot, policies={"imu": ActivationPolicy("catch-up")}, max_late_percent=100)
    (why,) = run.against
    assert "of the activations due lately came; expected 95%" in why


def test_of_several_models_the_latest_counts_and_the_shortest_period() -> None:
    """The slow model is late by little of its period, the fast one by more than its own."""
    model = Coupled("robot")
    model.add(Sampler("slow", TENTH))
    model.add(Sampler("fast", PERIOD))
    (why,) = Run(StallingClock({550: 15 * MILLISECOND}), model).against
    assert "15.0 ms late" in why
    assert "later than a period (10 ms)" in why


def test_without_a_period_none_is_expected() -> None:
    model = Coupled("robot")
    model.add(Beacon("beacon"))
    (why,) = Run(StallingClock(dict.fromkeys(range(300, 400), 2 * MILLISECOND)), model).against
    assert why.endswith("expected at most 1 %")


def test_where_timing_is_not_judged_nothing_late_is_one() -> None:
    late = dict.fromkeys(range(1, 600, 2), 15 * MILLISECOND)
    assert Run(StallingClock(late)).against != []
    assert Run(StallingClock(late), max_late_percent=100).against == []
