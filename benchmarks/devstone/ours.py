"""One DEVStone run of this project's simulator: `python -m benchmarks.devstone.ours HI 200 20`."""

import json
import sys
from time import process_time

from benchmarks.devstone.models import devstone
from firmware_runtime.devs.simulator import Simulator


def main() -> None:
    """Build and run the model named on the command line; print what it took."""
    shape, width, depth = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    begun = process_time()
    model = devstone(shape, width, depth)
    modelled = process_time()
    simulator = Simulator(model, checked=False)
    prepared = process_time()
    simulator.run(0)
    ended = process_time()
    seconds = {
        "model": modelled - begun,
        "simulator": prepared - modelled,
        "run": ended - prepared,
    }
    counts = {
        "internal": simulator.internal_transitions - 1,  # the seeder's is not counted
        "external": simulator.external_transitions,
    }
    print(json.dumps({"seconds": seconds, "counts": counts}))


if __name__ == "__main__":
    main()
