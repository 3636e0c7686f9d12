"""What was found, as lines for a terminal."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import Final

from firmware_runtime.recording.replay.difference import in_lines
from firmware_runtime.recording.replay.outputs import OutputDifference
from firmware_runtime.recording.versions import versions_said
from firmware_runtime.recording.what_if.what_if import WhatIf

SHOWN: Final = 12
_HEADS: Final = ("output", "differ", "of", "max", "rms", "first, s")


def what_if_text(found: WhatIf, changed: str) -> Iterator[str]:
    """All lines; `changed` says what was."""
    yield f"what if: {changed}"
    for fault in found.faults:
        yield f"  not whole: {fault}"
    if found.failure is not None:
        yield f"  the changed code failed: {found.failure}"
    if not found.outputs and not found.structure:
        yield f"  no output of {found.run} would have been another: {found.events} values"
    elif found.outputs:
        outputs = f"{len(found.outputs)} outputs and fields of {found.run} differ"
        yield f"  {outputs}, open loop: what entered is what was recorded"
        yield from table(found.outputs)
    yield from (f"  not compared: {each}" for each in found.not_compared)
    for what, count in found.structure.items():
        yield f"  {count} {what}"
    if found.first_difference is not None:
        first, *values = in_lines(found.first_difference)
        yield from (f"  first {first}", *(f"  {each}" for each in values))
    yield f"  {found.steps} steps, {found.duration_s:.3f} s of the run"
    if found.began_earlier is not None:
        yield f"  {found.began_earlier}"
    if found.versions_changed:
        yield f"  versions that are others than in the run: {versions_said(found.versions_changed)}"


def table(outputs: Mapping[str, OutputDifference]) -> Iterator[str]:
    """The outputs that differ most, and how many others there are."""
    rows = [_HEADS, *(_row(name, each) for name, each in islice(outputs.items(), SHOWN))]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEADS))]
    for row in rows:
        first, *rest = (cell for cell in row)
        cells = (cell.rjust(width) for cell, width in zip(rest, widths[1:], strict=True))
        yield f"  {first.ljust(widths[0])}  {'  '.join(cells)}"
    if len(outputs) > SHOWN:
        yield f"  and {len(outputs) - SHOWN} more (--json has them all)"


def _row(name: str, found: OutputDifference) -> Sequence[str]:
    differ = found.count + found.recorded_only + found.replayed_only
    return (
        name,
        str(differ),
        str(found.of + found.recorded_only + found.replayed_only),
        number(found.max),
        number(found.rms),
        "-" if found.first_s is None else f"{found.first_s:.3f}",
    )


def number(value: float | None) -> str:
    """A figure, four digits of it."""
    return "-" if value is None else f"{value:.4g}"
