"""One run of the hold model on this project's simulator: `python -m benchmarks.hold.ours equal 50`.

What it prints is described in `shared.side_by_side`.
"""

import sys

from benchmarks.hold.measure import end, periods
from benchmarks.shared.side_by_side import print_sample
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


def hold_model(kind: str, count: int) -> Coupled:
    """The model of that many atomics."""
    model = Coupled("hold")
    for number, period in enumerate(periods(kind, count)):
        model.add(Waiting(f"waiting_{number}", period))
    return model


def main() -> None:
    """Build and run the model named on the command line; print what it took."""
    kind, count = sys.argv[1], int(sys.argv[2])
    print_sample(
        lambda: hold_model(kind, count),
        lambda model: Simulator(model, checked=False),
        lambda simulator: simulator.run(end(count)),
        lambda _, simulator: {"internal": simulator.internal_transitions},
    )


if __name__ == "__main__":
    main()
