"""TachoBot on doubles at one rate, as a process of its own; the search for the highest that holds.

What follows from a rate: the IMU samples at twice as much or its most, 1000 Hz; lateness up to a
tenth of the period is tolerated, as it is when a board says nothing; the bus is said to be fast, or
the board would refuse the load. On doubles no transaction takes time on a wire.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from scipy.stats import gamma

from benchmarks.shared.process import LoopError, tachobot
from firmware_runtime.statistics.comparison import difference
from firmware_runtime.statistics.layout import ELAPSED

LOWEST_HZ, HIGHEST_HZ = 40, 999
"""The board's: two periods fit into the propellers' timeout, and the IMU outruns the loop."""
ALLOWED = 1e-4
"""The share of activations that may be late."""
STEADY_NS = 1_000_000_000
"""When bring-up and calibration are over."""
CERTAINTY = 0.95
_WORST = 64
_SAMPLE_HZ = (50, 100, 125, 200, 250, 500, 1000)


def highest_share(count: int, of: int) -> float:
    """The share that the truth does not exceed, with CERTAINTY, after `count` late `of` all.

    Late activations are taken as independent and rare, so their number is Poisson distributed; of
    ones that come in rows the truth may be worse. None late of 10,000 gives 3.0 in 10,000.
    """
    return min(float(gamma.ppf(CERTAINTY, count + 1)) / of, 1.0)


def needed(share: float) -> int:
    """How many activations, none late, show with CERTAINTY that fewer than this share are."""
    return math.ceil(-math.log(1 - CERTAINTY) / share)


def assignments(rate_hz: int) -> list[str]:
    """What to set in TachoBot's board.toml."""
    sample_hz = next((each for each in _SAMPLE_HZ if each >= 2 * rate_hz), _SAMPLE_HZ[-1])
    return [
        f"controller.period_s={1 / rate_hz:.9f}",
        f"imu.sample_hz={sample_hz}",
        f"overruns.imu.tolerance_us={1e5 / rate_hz:.1f}",
        "buses.i2c1.speed_hz=3400000",
        f"executive.worst={_WORST}",
    ]


def run(directory: Path, rate_hz: int, activations: int) -> dict[str, Any]:
    """One run of so many activations in steady state. Raises LoopError."""
    seconds = STEADY_NS / 1e9 + activations / rate_hz
    with tachobot(directory, seconds, assignments(rate_hz)) as running:
        before = running.read_when(lambda statistics: statistics.cells[ELAPSED] >= STEADY_NS)
        after = running.finished()
    return {"rate_hz": rate_hz, **outcome(difference(after, before).as_json())}


def outcome(statistics: dict[str, Any]) -> dict[str, Any]:
    """What became of the activations. Raises LoopError when there was none."""
    scheduled, dropped = statistics["scheduled"], statistics["scheduled"] - statistics["run"]
    if scheduled == 0:
        raise LoopError("tachobot had no activation after its first second; expected more of them")
    late = statistics["overruns"] + dropped
    return {
        "activations": scheduled,
        "late": late,
        "dropped": dropped,
        **causes(statistics),
        "at_most": highest_share(late, scheduled),
        "holds": late < ALLOWED * scheduled,
        "lateness_us": statistics["lateness_us"],
        "step_us": statistics["step_us"],
        "scheduler": statistics["conditions"]["scheduler"],
    }


def causes(statistics: dict[str, Any]) -> dict[str, int]:
    """Of the worst activations that were late: how many were so by whom.

    The system woke a loop late that had nothing to do; otherwise an earlier step of ours was still
    under way.
    """
    late = [
        each
        for each in statistics["worst"]
        if each["lateness_us"] > statistics["models"][each["model"]]["tolerance_us"]
    ]
    woken = [each for each in late if each["causes"]["wake_us"] > each["lateness_us"] / 2]
    return {"late_by_system": len(woken), "late_by_us": len(late) - len(woken)}


def highest(
    rates: Sequence[int], measure: Callable[[int], dict[str, Any]], refinements: int
) -> list[dict[str, Any]]:
    """Try rates from the highest down to the first that holds, then halve the gap above it.

    Returns all that were tried, by rate.
    """
    tried: list[dict[str, Any]] = []
    for rate_hz in sorted(rates, reverse=True):
        tried.append(measure(rate_hz))
        if tried[-1]["holds"]:
            break
    if tried[-1]["holds"] and len(tried) > 1:
        low, high = tried[-1]["rate_hz"], tried[-2]["rate_hz"]
        for _ in range(refinements):
            middle = measure((low + high) // 2)
            tried.append(middle)
            low, high = (middle["rate_hz"], high) if middle["holds"] else (low, middle["rate_hz"])
    return sorted(tried, key=lambda each: int(each["rate_hz"]))
