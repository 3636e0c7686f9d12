"""A sweep's summary for a terminal."""

from collections.abc import Iterator
from typing import Final

from firmware_runtime.lab.sweeps.summary import Case, Spread, Summary
from firmware_runtime.statistics.run_text import aligned

_BARS: Final = " ▁▂▃▄▅▆▇█"
_HEAD: Final = ("figure", "min", "5 %", "median", "mean", "95 %", "max", "spread")


def text_of(found: Summary) -> Iterator[str]:
    """Its lines."""
    outcomes = ", ".join(f"{count} {name}" for name, count in found.outcomes.items())
    yield f"{found.rows} runs: {outcomes}"
    for name, share in found.shares.items():
        yield f"{name}: true in {share.true} of {share.count} ({share.share:.1%})"
    yield ""
    yield from _aligned([_HEAD, *(_cells(name, each) for name, each in found.spreads.items())])
    for name, cases in found.worst.items():
        yield ""
        yield _heading(name, cases[0])
        for case in cases:
            value = f"{case.value:.6g}" if isinstance(case.value, float) else case.value
            yield f"  row {case.row}: {value}{f', {case.why}' if case.why else ''}"
            yield f"    {case.command}"


def _heading(name: str, case: Case) -> str:
    """What the rows below have in common."""
    if name == "outcome":
        return "did not end in order:"
    if isinstance(case.value, bool):
        return f"{name} is {'true' if case.value else 'false'}:"
    return f"largest {name}:"


def _cells(name: str, spread: Spread) -> tuple[str, ...]:
    numbers = (spread.min, spread.p05, spread.median, spread.mean, spread.p95, spread.max)
    most = max(spread.histogram)
    bars = "".join(_BARS[-(-8 * count // most)] for count in spread.histogram)
    return (name, *(f"{each:.4g}" for each in numbers), bars)


def _aligned(rows: list[tuple[str, ...]]) -> Iterator[str]:
    """The lines of a table; the bars at the end are not put to the right."""
    for line, row in zip(aligned([row[:-1] for row in rows]), rows, strict=True):
        yield f"{line}  {row[-1]}".rstrip()
