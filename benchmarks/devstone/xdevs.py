"""One DEVStone run of xdevs.py: `python -m benchmarks.devstone.xdevs HI 200 20 [count]`.

The model is the one that xdevs.py brings along. It counts transitions only on request, which costs
it time: so the runs that are timed do not count, and the one that counts is not timed.
"""

import json
import sys
from time import process_time

from xdevs.examples.devstone.devstone import DEVStone
from xdevs.sim import Coordinator


def main() -> None:
    """Build and run the model named on the command line; print what it took."""
    shape, width, depth = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    counting = sys.argv[4:] == ["count"]
    begun = process_time()
    model = DEVStone("devstone", shape, width, depth, 0, 0, counting)
    modelled = process_time()
    coordinator = Coordinator(model)
    coordinator.initialize()
    prepared = process_time()
    coordinator.simulate_time()
    ended = process_time()
    seconds = {
        "model": modelled - begun,
        "simulator": prepared - modelled,
        "run": ended - prepared,
    }
    counts = {"internal": model.n_internals, "external": model.n_externals} if counting else {}
    print(json.dumps({"seconds": seconds, "counts": counts}))


if __name__ == "__main__":
    main()
