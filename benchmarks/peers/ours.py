"""This project's executive in `bench peers`, with the policy skip or catch-up."""

from collections.abc import Callable

from benchmarks.peers.plan import Plan
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.policy import ActivationPolicy, Policy
from firmware_runtime.executive.process import ProcessSettings


class Periodic(Atomic):
    """Fires, period after period. `now` reads the model's time: periods may be skipped."""

    def __init__(self, plan: Plan) -> None:
        super().__init__("periodic")
        self.period = plan.period_ns
        self.now: Callable[[], int] = int
        self._fire = plan.fire

    def initialize(self) -> None:
        """Wait for the first."""
        self.hold_in("waiting", self.period)

    def output(self) -> None:
        """Fire."""
        self._fire(self.now() // self.period)

    def internal(self) -> None:
        """Wait for the next."""
        self.hold_in("waiting", self.period)


def skip(plan: Plan) -> str:
    """Run with the default policy."""
    return _run(plan, "skip")


def catch_up(plan: Plan) -> str:
    """Run every missed activation."""
    return _run(plan, "catch-up")


def _run(plan: Plan, policy: Policy) -> str:
    configuration = Configuration(
        policies={"periodic": ActivationPolicy(policy)},
        process=ProcessSettings(freeze_garbage=True),
    )
    model = Periodic(plan)
    executive = Executive(model, MonotonicClock(), list, configuration)
    model.now = lambda: executive.simulator.now
    executive.run(plan.period_ns * plan.periods)
    counted = executive.statistics.as_json()
    return f"{counted['overruns']} overruns, {counted['skipped']} skipped"
