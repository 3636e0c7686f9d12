"""One run of the hold model on xdevs.py: `python -m benchmarks.hold.xdevs equal 50`.

What it prints is described in `shared.side_by_side`.
"""

import sys

from xdevs.models import Atomic, Coupled
from xdevs.sim import Coordinator

from benchmarks.hold.measure import end, periods
from benchmarks.shared.side_by_side import print_sample


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


def hold_model(kind: str, count: int) -> Coupled:
    """The model of that many atomics."""
    model = Coupled("hold")
    for number, period in enumerate(periods(kind, count)):
        model.add_component(Waiting(f"waiting_{number}", period))
    return model


def initialized(model: Coupled) -> Coordinator:
    """A coordinator of a model, ready to run."""
    coordinator = Coordinator(model)
    coordinator.initialize()
    return coordinator


def main() -> None:
    """Build and run the model named on the command line; print what it took."""
    kind, count = sys.argv[1], int(sys.argv[2])
    first = min(periods(kind, count))  # the peer counts its time from the first event
    print_sample(
        lambda: hold_model(kind, count),
        initialized,
        lambda coordinator: coordinator.simulate_time(end(count) + 1 - first),
        lambda model, _: {"internal": sum(atomic.count for atomic in model.components)},
    )


if __name__ == "__main__":
    main()
