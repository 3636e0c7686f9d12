"""One run of the hold model on this project's simulator: `python -m benchmarks.hold.ours equal 50`.

What it prints is described in `shared.side_by_side`.
"""

import json
import sys
from time import process_time

from benchmarks.hold.plan import end, periods
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator


class Waiting(Atomic):
    """Waits, period after period."""

    def __init__(self, name: str, period: int) -> None:
        super().__init__(name)
        self.period = period

    def initialize(self) -> None:
        """Wait."""
        self.hold_in("waiting", self.period)

    def internal(self) -> None:
        """Wait again."""
        self.hold_in("waiting", self.period)


def main() -> None:
    """Build and run the model named on the command line; print what it took."""
    kind, count = sys.argv[1], int(sys.argv[2])
    begun = process_time()
    model = Coupled("hold")
    for number, period in enumerate(periods(kind, count)):
        model.add(Waiting(f"waiting_{number}", period))
    modelled = process_time()
    simulator = Simulator(model, checked=False)
    prepared = process_time()
    simulator.run(end(count))
    ended = process_time()
    seconds = {
        "model": modelled - begun,
        "simulator": prepared - modelled,
        "run": ended - prepared,
    }
    counts = {"internal": simulator.internal_transitions}
    print(json.dumps({"seconds": seconds, "counts": counts}))


if __name__ == "__main__":
    main()
