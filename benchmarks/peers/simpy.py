"""SimPy's real-time environment in `bench peers`.

Not a strict one: that ends with an error at an event more than its unit, one second, late.
"""

from collections.abc import Generator

from simpy.events import Timeout
from simpy.rt import RealtimeEnvironment

from benchmarks.peers.plan import Plan


def run(plan: Plan) -> str:
    """Run it; SimPy says nothing about being late."""
    environment = RealtimeEnvironment(factor=1.0, strict=False)

    def periodic() -> Generator[Timeout]:
        for number in range(1, plan.periods + 1):
            yield environment.timeout(plan.period_s)
            plan.fire(number)

    environment.process(periodic())
    environment.run()
    return "nothing"
