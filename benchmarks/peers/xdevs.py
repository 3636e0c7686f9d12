"""xdevs.py's real-time coordinator in `bench peers`.

As its examples use it, without a greatest jitter: with one, a run ends at the first that is larger.
"""

from xdevs.models import Atomic, Coupled
from xdevs.rt import RealTimeCoordinator, RealTimeManager

from benchmarks.peers.plan import Plan


class Periodic(Atomic):  # type: ignore[misc]  # xdevs.py is untyped
    """Fires, period after period."""

    def __init__(self, plan: Plan) -> None:
        super().__init__("periodic")
        self._plan = plan
        self._number = 0

    def initialize(self) -> None:
        """Wait for the first."""
        self.hold_in("waiting", self._plan.period_s)

    def lambdaf(self) -> None:
        """Fire."""
        self._plan.fire(self._number + 1)

    def deltint(self) -> None:
        """Wait for the next."""
        self._number += 1
        self.hold_in("waiting", self._plan.period_s)

    def deltext(self, e: float) -> None:
        """Nothing comes in."""

    def exit(self) -> None:
        """Nothing is left behind."""


def run(plan: Plan) -> str:
    """Run it; xdevs.py says nothing about being late."""
    model = Coupled("top")
    model.add_component(Periodic(plan))
    RealTimeCoordinator(model, RealTimeManager()).simulate_rt(plan.period_s * (plan.periods + 0.5))
    return "nothing"
