"""One DEVStone run of xdevs.py: `python -m benchmarks.devstone.xdevs HI 200 20 [count]`.

The model is the one that xdevs.py brings along. It counts transitions only on request, which costs
it time: so the runs that are timed do not count, and the one that counts is not timed.
"""

import sys

from xdevs.examples.devstone.devstone import DEVStone

from benchmarks.hold.xdevs import initialized
from benchmarks.shared.side_by_side import print_sample


def main() -> None:
    """Build and run the model named on the command line; print what it took."""
    shape, width, depth = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    counting = sys.argv[4:] == ["count"]
    print_sample(
        lambda: DEVStone("devstone", shape, width, depth, 0, 0, counting),
        initialized,
        lambda coordinator: coordinator.simulate_time(),
        lambda model, _: (
            {"internal": model.n_internals, "external": model.n_externals} if counting else {}
        ),
    )


if __name__ == "__main__":
    main()
