"""The report of `bench peers` as a person reads it."""

from collections.abc import Iterator, Mapping
from typing import Any

_WIDTH = 15


def peers_lines(report: Mapping[str, Any]) -> Iterator[str]:
    """All lines."""
    settings = next(iter(next(iter(report["rates"].values())).values()))["settings"]
    granted = [name for name, each in settings.items() if each["granted"]]
    yield f"granted to all: {', '.join(granted) or 'nothing'}"
    if report["not_installed"]:
        yield f"not installed: {', '.join(report['not_installed'])} (dependency group bench)"
    for rate_hz, engines in report["rates"].items():
        yield ""
        yield from _table(rate_hz, engines)
    yield ""
    yield f"ratio {report['ratio']:.1f} (p99 at 1000 Hz, xdevs.py by ours, skip)"


def _table(rate_hz: str, engines: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    head = "".join(f"{column:>10}" for column in ("p50 us", "p99 us", "max us", "drift ppm"))
    stall = "after a stall of 500 ms: late events, in phase after, told"
    yield f"{rate_hz + ' Hz':{_WIDTH}}{head}{'CPU':>7} | {stall}"
    for name, each in engines.items():
        times = "".join(f"{each[key]:10.1f}" for key in ("p50_us", "p99_us", "max_us", "drift_ppm"))
        yield (
            f"{name:{_WIDTH}}{times}{each['cpu']:7.1%} | {each['late_events']:.0f}, "
            f"{_after(each['in_phase_after_ms'])}, {each['told']}"
        )


def _after(milliseconds: float | None) -> str:
    return "never" if milliseconds is None else f"{milliseconds:.1f} ms"
