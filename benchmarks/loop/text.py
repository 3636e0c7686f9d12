"""The report of `bench loop` for people."""

from collections.abc import Iterator, Mapping
from typing import Any

from benchmarks.loop.rates import ALLOWED, needed
from benchmarks.loop.split import KINDS

_COLUMNS = (
    "activations",
    "late",
    "dropped",
    "by system",
    "by us",
    "at most",
    "p50 us",
    "p99 us",
    "holds",
)


def loop_lines(report: Mapping[str, Any]) -> Iterator[str]:
    """All lines."""
    yield from ("", *_split_text(report["split"]), "")
    yield from _wire_text(report["wire"], report["split"], report["own_hz"])
    yield from ("", *_rates_text(report["rates"]))
    found = report["highest_hz"]
    yield "  none of these rates holds" if found is None else f"  highest: {found} Hz"
    if report["highest_hz_by_us"] is not None:
        yield f"  highest without one late by us: {report['highest_hz_by_us']} Hz"
    by = f"highest rate that holds by the board's own {report['own_hz']} Hz"
    yield f"ratio {report['ratio']:.2f} ({by})"


def _split_text(splits: list[dict[str, Any]]) -> list[str]:
    heads = [f"{each['rate_hz']} Hz" for each in splits]
    lines = ["Microseconds a tick, medians:", _row("", heads)]
    for kind in KINDS:
        lines.append(_row(kind, [f"{each['kinds_us'][kind]:.1f}" for each in splits]))
        lines += [
            _row(f"  {label}", [f"{each['us'].get(label, 0):.1f}" for each in splits])
            for label in splits[0]["us"]
            if label.startswith(f"{kind} ")
        ]
    lines.append(_row("together", [f"{sum(each['kinds_us'].values()):.1f}" for each in splits]))
    lines.append(_row("of a processor", [f"{each['busy']:.1%}" for each in splits]))
    return lines


def _wire_text(wire_: dict[str, float], splits: list[dict[str, Any]], own_hz: int) -> list[str]:
    lines = [
        f"On the wire at {wire_['bus_hz'] / 1e3:g} kHz, computed, not measured:",
        f"  {wire_['us']:.0f} us a tick: the bus is full at {wire_['full_at_hz']:.0f} Hz",
        f"  the board is refused above {wire_['refused_above_hz']:.0f} Hz",
    ]
    for each in splits:
        if each["rate_hz"] == own_hz:
            rest = sum(us for kind, us in each["kinds_us"].items() if kind != "double")
            tick_us = rest + wire_["us"]
            lines += [
                f"  this machine's tick at {own_hz} Hz, with it for the doubles: {tick_us:.0f} us",
                f"  which could be repeated at {1e6 / tick_us:.0f} Hz at most",
            ]
    return lines


def _rates_text(tried: list[dict[str, Any]]) -> list[str]:
    return [
        "Late by more than a tenth of a period, or dropped, after the first second:",
        _row("", [*_COLUMNS]),
        *(_row(f"{each['rate_hz']} Hz", _rate_cells(each)) for each in tried),
        f"  under {tried[0]['scheduler']}",
        "  by system, by us: of the 64 worst, those late because the system woke the loop late, or",
        "  because an earlier step of its own was still under way",
        "  at most: of all activations, with 95 % certainty, by this run alone;",
        f"  to show fewer than {ALLOWED:.2%} takes {needed(ALLOWED)} activations, none late",
    ]


def _rate_cells(tried: Mapping[str, Any]) -> list[str]:
    return [
        str(tried["activations"]),
        str(tried["late"]),
        str(tried["dropped"]),
        str(tried["late_by_system"]),
        str(tried["late_by_us"]),
        f"{tried['at_most']:.4%}",
        f"{tried['lateness_us']['p50']:.1f}",
        f"{tried['lateness_us']['p99']:.1f}",
        "yes" if tried["holds"] else "no",
    ]


def _row(name: str, cells: list[str]) -> str:
    return f"  {name:26}" + "".join(f"{cell:>12}" for cell in cells)
