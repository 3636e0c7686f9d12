"""What a bus outage makes of a mission of the detective robot, whenever it comes.

    python -m benchmarks.detective_outages [--json] [--missions N] [--lasts SECONDS] [--seed N]

Each mission runs in virtual time on register-level doubles, as `firmware-runtime run` runs it; at
an instant drawn at random no chip answers any more, for 0.3 s. Every mission must end, with its
target found or with a sentence, and every end must leave all outputs off. Prints what did not, and
last how many ended how.
"""

import argparse
import json
import random
import sys
from collections import Counter

from tests.support.detective_outage import Mission, mission_with_outage

SPAN_S = 36.0
"""A mission without an outage takes 34 s."""


def main() -> int:
    """Sweep and print; the exit status is 1 if a mission did not end, or ended unsafe."""
    parser = argparse.ArgumentParser(prog="benchmarks.detective_outages", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--missions", type=int, default=137)
    parser.add_argument("--lasts", type=float, default=0.3, metavar="SECONDS")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    instants = random.Random(arguments.seed)  # noqa: S311 -- repeatable, not secret
    ended: Counter[str] = Counter()
    for number in range(arguments.missions):
        at_s = instants.uniform(0.0, SPAN_S)
        mission = mission_with_outage(at_s, arguments.lasts, f"world.seed={number}")
        word = _word(mission)
        ended[word] += 1
        if word in {"not safe", "without an end"}:
            print(f"{word}: outage at {at_s:.3f} s: {mission.outcome}", file=sys.stderr)
    print(json.dumps(ended) if arguments.json else _text(ended))
    return 1 if ended["not safe"] + ended["without an end"] else 0


def _word(mission: Mission) -> str:
    if not mission.is_safe:
        return "not safe"
    if mission.ending is None:
        return "without an end"
    return "failed" if mission.ending.failed else "found"


def _text(ended: Counter[str]) -> str:
    return ", ".join(f"{count} {word}" for word, count in sorted(ended.items()))


if __name__ == "__main__":
    sys.exit(main())
