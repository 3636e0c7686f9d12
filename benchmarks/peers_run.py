"""One engine's run of a periodic model in real time: `python -m benchmarks.peers_run ENGINE JSON`.

The object has `period_ns`, `periods` and `stall_at`, the activation in which the model itself
stalls for `stall_ns` (0: never). Prints an object: `fired`, the number of each activation by the
model's own time and the instant it happened (CLOCK_MONOTONIC), `cpu_s`, and `told`, what the engine
itself has to say about being late.
"""

import json
import sys
from collections.abc import Callable
from time import monotonic_ns, process_time, sleep
from typing import Any, TypeAlias

Fired: TypeAlias = list[tuple[int, int]]


class Plan:
    """The period, how many there are, and the stall; `fire` is called in every activation."""

    def __init__(self, asked: dict[str, int]) -> None:
        self.period_ns = asked["period_ns"]
        self.periods = asked["periods"]
        self.fired: Fired = []
        self._stall_at = asked["stall_at"]
        self._stall_s = asked["stall_ns"] / 1e9

    def fire(self, number: int) -> None:
        """Note an activation; stall in the one that was chosen."""
        self.fired.append((number, monotonic_ns()))
        if self._stall_s > 0 and number == self._stall_at:
            sleep(self._stall_s)

    @property
    def is_over(self) -> bool:
        """Whether the last one has been fired."""
        return bool(self.fired) and self.fired[-1][0] >= self.periods


def ours(plan: Plan, policy: Any) -> str:  # noqa: ANN401 -- a word of the command line
    """This project's executive, with a policy."""
    from firmware_runtime.devs.atomic import Atomic  # noqa: PLC0415 -- one engine a process
    from firmware_runtime.executive.clocks import MonotonicClock  # noqa: PLC0415
    from firmware_runtime.executive.configuration import Configuration  # noqa: PLC0415
    from firmware_runtime.executive.loop import Executive  # noqa: PLC0415
    from firmware_runtime.executive.policy import ActivationPolicy  # noqa: PLC0415
    from firmware_runtime.executive.process import ProcessSettings  # noqa: PLC0415

    class Periodic(Atomic):
        period = plan.period_ns

        def initialize(self) -> None:
            self.hold_in("waiting", plan.period_ns)

        def output(self) -> None:
            plan.fire(executive.simulator.now // plan.period_ns)

        def internal(self) -> None:
            self.hold_in("waiting", plan.period_ns)

    configuration = Configuration(
        policies={"periodic": ActivationPolicy(policy)},
        process=ProcessSettings(timer_slack_ns=1, freeze_garbage=True),
    )
    executive = Executive(Periodic("periodic"), MonotonicClock(), list, configuration)
    executive.run(plan.period_ns * plan.periods)
    counted = executive.statistics.as_json()
    return f"{counted['overruns']} overruns, {counted['skipped']} skipped"


def xdevs(plan: Plan) -> str:
    """xdevs.py's real-time coordinator, as its examples use it."""
    from xdevs.models import Atomic, Coupled  # noqa: PLC0415
    from xdevs.rt import RealTimeCoordinator, RealTimeManager  # noqa: PLC0415

    class Periodic(Atomic):  # type: ignore[misc]  # xdevs.py is untyped
        number = 0

        def initialize(self) -> None:
            self.hold_in("waiting", plan.period_ns / 1e9)

        def lambdaf(self) -> None:
            self.number += 1
            plan.fire(self.number)

        def deltint(self) -> None:
            self.hold_in("waiting", plan.period_ns / 1e9)

        def deltext(self, e: float) -> None:
            pass

        def exit(self) -> None:
            pass

    model = Coupled("top")
    model.add_component(Periodic("periodic"))
    RealTimeCoordinator(model, RealTimeManager()).simulate_rt(
        plan.period_ns * (plan.periods + 0.5) / 1e9
    )
    return "nothing"


def simpy(plan: Plan) -> str:
    """SimPy's real-time environment, not strict: strict ones stop at the first late event."""
    from simpy.rt import RealtimeEnvironment  # noqa: PLC0415

    environment = RealtimeEnvironment(factor=1.0, strict=False)

    def periodic() -> Any:  # noqa: ANN401 -- SimPy's events
        for number in range(1, plan.periods + 1):
            yield environment.timeout(plan.period_ns / 1e9)
            plan.fire(number)

    environment.process(periodic())
    environment.run()
    return "nothing"


ENGINES: dict[str, Callable[[Plan], str]] = {
    "ours, skip": lambda plan: ours(plan, "skip"),
    "ours, catch-up": lambda plan: ours(plan, "catch-up"),
    "xdevs.py": xdevs,
    "SimPy": simpy,
}


def main() -> None:
    """Run one engine."""
    plan = Plan(json.loads(sys.argv[2]))
    before = process_time()
    told = ENGINES[sys.argv[1]](plan)
    answer = {"fired": plan.fired, "cpu_s": process_time() - before, "told": told}
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
