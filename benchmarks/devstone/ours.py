"""One DEVStone run of this project's simulator: `python -m benchmarks.devstone.ours HI 200 20`."""

import sys

from benchmarks.devstone.models import devstone
from benchmarks.shared.side_by_side import print_sample
from firmware_runtime.devs.simulator import Simulator


def main() -> None:
    """Build and run the model named on the command line; print what it took."""
    shape, width, depth = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    print_sample(
        lambda: devstone(shape, width, depth),
        lambda model: Simulator(model, checked=False),
        lambda simulator: simulator.run(0),
        lambda _, simulator: {
            "internal": simulator.internal_transitions - 1,  # the seeder's is not counted
            "external": simulator.external_transitions,
        },
    )


if __name__ == "__main__":
    main()
