"""What is wrong with the numbers that a world is made of."""

import math
from collections.abc import Collection, Iterator


def number_faults(
    of: object,
    *,
    positive: Collection[str],
    not_negative: Collection[str],
    finite: Collection[str],
) -> Iterator[str]:
    """A sentence for each number, by the name of its attribute, that is out of its range."""
    for name in positive:
        if not 0.0 < getattr(of, name) < math.inf:
            yield f"{name} is {getattr(of, name)}, expected a finite number above 0"
    for name in not_negative:
        if not 0.0 <= getattr(of, name) < math.inf:
            yield f"{name} is {getattr(of, name)}, expected a finite number, 0 or more"
    for name in finite:
        if not math.isfinite(getattr(of, name)):
            yield f"{name} is {getattr(of, name)}, expected a finite number"
