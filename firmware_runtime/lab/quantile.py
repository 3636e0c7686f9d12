"""Quantiles of values that are all at hand."""

from collections.abc import Sequence
from math import ceil


def quantile(ordered: Sequence[float], share: float) -> float | None:
    """Return the least value that at least this share does not pass; None of nothing."""
    if not ordered:
        return None
    return ordered[max(ceil(share * len(ordered)), 1) - 1]
