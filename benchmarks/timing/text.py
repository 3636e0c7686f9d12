"""The report of `bench timing` as a person reads it: histograms, percentiles, ratios, goals."""

from collections.abc import Iterator, Mapping
from typing import Any

_WIDTH, _NAMES = 21, 20
_STATES = {
    "awake": "all hold /dev/cpu_dma_latency at 0",
    "asleep": "/dev/cpu_dma_latency is not held: processors may sleep deeply",
}
_TITLES = {"p50": "p50", "p99": "p99", "p999": "p99.9"}


def timing_lines(report: Mapping[str, Any]) -> Iterator[str]:
    """All lines."""
    priority = report["fifo_priority"]
    scheduler = f"SCHED_FIFO {priority}" if priority else "SCHED_OTHER (SCHED_FIFO not granted)"
    yield (
        f"lateness at {report['rate_hz']} Hz, {scheduler}; cyclictest: until its thread is awake; "
        f"executive: until its step begins; spin {report['spin_us']:g} us"
    )
    for state, section in report["cpus"].items():
        yield ""
        yield _STATES[state]
        yield from _section(section)
    first, section = next(iter(report["cpus"].items()))
    name = next(iter(section["ratios"]))
    yield ""
    yield f"ratio {report['ratio']:.2f} ({first}: p99 of {name} by {section['base']})"


def _section(section: Mapping[str, Any]) -> Iterator[str]:
    refused = [
        name for name, each in section["settings"].items() if each["asked"] and not each["granted"]
    ]
    others = section["others"]
    yield (
        f"not granted: {', '.join(refused) or 'nothing'}; meanwhile other processes took "
        f"{others['processes']:.1%} of the processors, the host {others['host']:.1%}"
    )
    yield from _histograms(section["contestants"])
    yield from _figures(section)
    yield from _goals(section)


def _histograms(contestants: Mapping[str, Any]) -> Iterator[str]:
    yield f"{'':14}" + "  ".join(f"{name:{_WIDTH}}" for name in contestants).rstrip()
    edges = {int(edge) for each in contestants.values() for edge in each["histogram"]}
    for edge in sorted(edges):
        cells = [
            _bar(each["histogram"].get(str(edge), 0), max(each["histogram"].values()))
            for each in contestants.values()
        ]
        yield f"< {edge / 1000:8g} us " + "  ".join(cells).rstrip()


def _bar(count: int, most: int) -> str:
    """A bar by the longest, and how many, so that single ones are seen too."""
    room = _WIDTH - 8
    number = str(count) if count > 0 else ""
    return f"{number:>7} {'█' * -(-count * room // most)}".ljust(_WIDTH)


def _figures(section: Mapping[str, Any]) -> Iterator[str]:
    head = "".join(f"{f'{title} us':>10}" for title in (*_TITLES.values(), "max"))
    ranks = ", ".join(_TITLES.values())
    yield f"{'':{_NAMES}}{head}{'skipped':>9}{'CPU':>7}   by {section['base']}: {ranks}"
    for name, each in section["contestants"].items():
        ratios = ", ".join(f"{ratio:.2f}" for ratio in section["ratios"].get(name, {}).values())
        skipped = "-" if each["skipped"] is None else each["skipped"]
        yield f"{name:{_NAMES}}{_times(each)}{skipped:>9}{each['cpu']:7.1%}   {ratios}".rstrip()
        if each["output"] is not None:
            yield f"{'  output function':{_NAMES}}{_times(each['output'])}"


def _times(figures: Mapping[str, float]) -> str:
    return "".join(f"{figures[key] / 1000:10.1f}" for key in (*_TITLES, "max"))


def _goals(section: Mapping[str, Any]) -> Iterator[str]:
    for name, goals in section["goals"].items():
        verdicts = [
            f"{_TITLES[key]} {section['ratios'][name][key]:.2f}, at most {goal:g}: "
            + ("met" if section["ratios"][name][key] <= goal else "missed")
            for key, goal in goals.items()
        ]
        yield f"goal of {name}: {'; '.join(verdicts)}"
