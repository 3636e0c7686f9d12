"""The report of `bench timing` as a person reads it: histograms, percentiles, ratios."""

from collections.abc import Iterator, Mapping
from typing import Any

_WIDTH = 20


def timing_text(report: Mapping[str, Any]) -> str:
    """All lines."""
    return "\n".join(_lines(report))


def _lines(report: Mapping[str, Any]) -> Iterator[str]:
    found = report["conditions"]
    scheduler = f"SCHED_FIFO {found['fifo_priority']}" if found["fifo_priority"] else "SCHED_OTHER"
    yield f"lateness at {found['rate_hz']} Hz, {scheduler}, spin {found['spin_us']:g} us"
    where = "a virtual machine" if found["virtualised"] else "no virtual machine seen"
    yield (
        f"{found['python']} on {found['kernel']} {found['machine']}, {found['cpu']}, "
        f"{found['cpu_count']} CPUs, {where}, load {found['load']:.2f}"
    )
    refused = [
        name for name, each in found["settings"].items() if each["asked"] and not each["granted"]
    ]
    yield f"not granted: {', '.join(refused) or 'nothing'}"
    yield ""
    yield from _histograms(report["contestants"])
    yield ""
    yield from _figures(report)
    yield f"ratio {report['ratio']:.2f} (p99 without spin by cyclictest's, goal at most 1.5)"


def _histograms(contestants: Mapping[str, Any]) -> Iterator[str]:
    yield f"{'':>12}  " + "  ".join(f"{name:{_WIDTH}}" for name in contestants)
    octaves = sorted({int(octave) for each in contestants.values() for octave in each["octaves"]})
    for octave in octaves:
        cells = [
            _bar(each["octaves"].get(str(octave), 0), each["samples"])
            for each in contestants.values()
        ]
        yield f"< {2**octave / 1000:7.1f} us  " + "  ".join(cells)


def _bar(count: int, samples: int) -> str:
    """A bar, and how many, so that single ones are seen too."""
    number = str(count) if count > 0 else ""
    room = _WIDTH - len(number) - 1
    return f"{'█' * -(-count * room // max(samples, 1))} {number}".ljust(_WIDTH)


def _figures(report: Mapping[str, Any]) -> Iterator[str]:
    head = "".join(f"{name:>9}" for name in ("p50 us", "p99 us", "p99.9 us", "max us"))
    yield f"{'':22}{head}{'CPU':>7}   ratios of p50, p99, p99.9; goals"
    for name, each in report["contestants"].items():
        times = "".join(f"{each[key] / 1000:9.1f}" for key in ("p50", "p99", "p999", "max"))
        ratios = report["ratios"].get(name)
        beside = (
            "" if ratios is None else "   " + ", ".join(f"{ratio:.2f}" for ratio in ratios.values())
        )
        goals = report["goals"].get(name)
        aims = (
            ""
            if goals is None
            else "; " + ", ".join(f"{key} {goal:g}" for key, goal in goals.items())
        )
        yield f"{name:22}{times}{each['cpu']:7.1%}{beside}{aims}"
