"""One run of the hold model on xdevs.py: `python -m benchmarks.hold.xdevs equal 50`.

What it prints is described in `shared.side_by_side`.
"""

import json
import sys
from time import process_time

from xdevs.models import Atomic, Coupled
from xdevs.sim import Coordinator

from benchmarks.hold.plan import end, periods


class Waiting(Atomic):  # type: ignore[misc]  # xdevs.py is untyped
    """Waits, period after period."""

    def __init__(self, name: str, period: int) -> None:
        super().__init__(name)
        self.period = period
        self.count = 0

    def initialize(self) -> None:
        """Wait."""
        self.hold_in("waiting", self.period)

    def lambdaf(self) -> None:
        """Send nothing."""

    def deltint(self) -> None:
        """Wait again."""
        self.count += 1
        self.hold_in("waiting", self.period)

    def deltext(self, e: float) -> None:
        """Nothing arrives here."""

    def exit(self) -> None:
        """Do nothing: xdevs.py wants it written."""


def main() -> None:
    """Build and run the model named on the command line; print what it took."""
    kind, count = sys.argv[1], int(sys.argv[2])
    begun = process_time()
    model = Coupled("hold")
    atomics = [
        Waiting(f"waiting_{number}", period) for number, period in enumerate(periods(kind, count))
    ]
    for atomic in atomics:
        model.add_component(atomic)
    modelled = process_time()
    coordinator = Coordinator(model)
    coordinator.initialize()
    prepared = process_time()
    first = min(periods(kind, count))  # the peer counts its time from the first event
    coordinator.simulate_time(end(count) + 1 - first)
    ended = process_time()
    seconds = {
        "model": modelled - begun,
        "simulator": prepared - modelled,
        "run": ended - prepared,
    }
    counts = {"internal": sum(atomic.count for atomic in atomics)}
    print(json.dumps({"seconds": seconds, "counts": counts}))


if __name__ == "__main__":
    main()
