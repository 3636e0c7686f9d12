"""pyjevsim's real time (R_TIME) in `bench peers`: it goes by ticks, here one a period."""

from pyjevsim import BehaviorModel, ExecutionType, SysExecutor

from benchmarks.peers.plan import Plan


class Periodic(BehaviorModel):  # type: ignore[misc]  # pyjevsim is untyped
    """Fires, period after period."""

    def __init__(self, plan: Plan) -> None:
        super().__init__("periodic")
        self._plan = plan
        self._number = 0
        self.init_state("waiting")
        self.insert_state("waiting", plan.period_s)

    def ext_trans(self, port: object, msg: object) -> None:
        """Nothing comes in."""

    def output(self, msg_deliver: object) -> None:  # noqa: ARG002 -- it goes nowhere
        """Fire."""
        self._plan.fire(self._number + 1)

    def int_trans(self) -> None:
        """Wait for the next."""
        self._number += 1


def run(plan: Plan) -> str:
    """Run it; pyjevsim says nothing about being late."""
    executor = SysExecutor(plan.period_s, ex_mode=ExecutionType.R_TIME)
    executor.register_entity(Periodic(plan))
    executor.simulate(plan.period_s * (plan.periods + 1.5))
    return "nothing"
