"""What rounds with and without a reader say: the ratio of p99, and how sure it is.

A round's ratio is p99 of the segment with the reader by the geometric mean of p99 of the two that
were alone, seconds before and after; the ratio is the median over the rounds, so a stall of the
machine spoils a round and no more. The control is the same for the two that were alone, one by the
other: what it shows is the machine's doing. How sure they are, is found by drawing as many rounds
as there are, again and again, with replacement: 95 of 100 such medians lie within the interval.
A percentile is a bucket's upper edge, so the ratio of a round comes in steps of up to 3 %.
"""

from collections.abc import Sequence
from math import sqrt
from random import Random
from statistics import median, quantiles
from typing import Any

from benchmarks.reader.rounds import ALONE, ALONE_AGAIN, KINDS, READ, Round
from firmware_runtime.statistics.histogram import Histogram, empty_cells

GOAL = 0.10
"""A reader changes the loop's p99 by less."""
DRAWS = 4_000
PERCENTILES = {"p50": 500, "p99": 990, "p999": 999}


def summary(rounds: Sequence[Round]) -> dict[str, Any]:
    """Percentiles by kind, and p99 with the reader by p99 without, beside the control."""
    p99 = [{kind: _percentile(each[kind], 990) for kind in KINDS} for each in rounds]
    control = [each[ALONE_AGAIN] / each[ALONE] for each in p99]
    ratio = sure([each[READ] / sqrt(each[ALONE] * each[ALONE_AGAIN]) for each in p99])
    together = {kind: merged([each[kind] for each in rounds]) for kind in KINDS}
    return {
        "samples": {kind: together[kind].samples for kind in KINDS},
        "us": {
            kind: {name: _percentile(all_, rank) / 1000 for name, rank in PERCENTILES.items()}
            for kind, all_ in together.items()
        },
        "control": sure(control),
        **ratio,
        "shown": ratio["low"] > 1 - GOAL and ratio["high"] < 1 + GOAL,
    }


def sure(ratios: Sequence[float]) -> dict[str, float]:
    """The median of the rounds' ratios, and what it lies between with 95 % certainty."""
    draw = Random(1).choices  # noqa: S311 -- nothing is secret
    medians = [median(draw(ratios, k=len(ratios))) for _ in range(DRAWS)]
    low, *_, high = quantiles(medians, n=40)
    return {"low": low, "high": high, "ratio": median(ratios)}


def merged(histograms: Sequence[Histogram]) -> Histogram:
    """All samples in one histogram."""
    together = Histogram(empty_cells())
    for each in histograms:
        together.merge(each)
    return together


def _percentile(histogram: Histogram, thousandths: int) -> int:
    """In ns; 1 where there is no lateness at all, or no sample."""
    return histogram.percentile(thousandths) or 1
