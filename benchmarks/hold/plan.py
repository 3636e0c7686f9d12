"""The hold model: N uncoupled atomics, each of which does nothing but wait, period after period.

It measures what an engine needs to find out who is next. The periods are all equal, so all are due
together, or all distinct, so hardly ever two are.
"""

KINDS = ("equal", "distinct")
TRANSITIONS = 20_000
"""About how many internal transitions a run has."""
PERIOD = 1_000_003
"""The shortest period, ns; a prime, so distinct ones seldom meet."""


def periods(kind: str, count: int) -> list[int]:
    """The atomics' periods, ns."""
    return [PERIOD + (2 * number if kind == "distinct" else 0) for number in range(count)]


def end(count: int) -> int:
    """How long a run takes, ns."""
    return PERIOD * TRANSITIONS // count + PERIOD // 2


def transitions(kind: str, count: int) -> int:
    """How many internal transitions a run really has."""
    return sum(end(count) // period for period in periods(kind, count))
