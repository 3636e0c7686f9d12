"""Differences that a change would make, for people: lines for a terminal, and a page."""

from collections.abc import Iterator
from itertools import islice
from typing import Final

from firmware_runtime.recording.recorded_board import versions_said
from firmware_runtime.recording.replay.difference import in_lines
from firmware_runtime.recording.replay.outputs import OutputDifference
from firmware_runtime.recording.what_if.what_if import WhatIf
from firmware_runtime.statistics.run_text import aligned
from firmware_runtime.view.parts import Page, Section, Series, Text, curve, section, table

PLOTS: Final = 6
SHOWN: Final = 12
_HEADS: Final = ("output", "differ", "of", "max", "rms", "first, s")


def what_if_text(found: WhatIf, changed: str) -> Iterator[str]:
    """All lines for a terminal; `changed` says what was."""
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
        shown = [_row(*each) for each in islice(found.outputs.items(), SHOWN)]
        yield from (f"  {line}" for line in aligned([_HEADS, *shown]))
        if len(found.outputs) > SHOWN:
            yield f"  and {len(found.outputs) - SHOWN} more (--json has them all)"
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


def _row(name: str, found: OutputDifference) -> tuple[str, ...]:
    missing = found.recorded_only + found.replayed_only
    return (
        name,
        str(found.count + missing),
        str(found.of + missing),
        number(found.max),
        number(found.rms),
        "-" if found.first_s is None else f"{found.first_s:.3f}",
    )


def number(value: float | None) -> str:
    """A figure, four digits of it."""
    return "-" if value is None else f"{value:.4g}"


def what_if_page(found: WhatIf, changed: str) -> Page:
    """The outputs that differ most, and all that differ."""
    said = "Open loop: what entered is what was recorded, so its own effect is not in it."
    if not found.curves:
        said = f"No number differs. {said}"
    return Page(
        title=f"{found.run}: {changed}",
        opening=[Text(text=said, look="quiet"), *_doubts(found)],
        parts=list(_sections(found)),
    )


def _doubts(found: WhatIf) -> Iterator[Text]:
    """Sentences of what is missing, and of a failure."""
    if found.failure is not None:
        yield Text(text=f"The changed code failed: {found.failure}", look="warning")
    yield from (Text(text=f"Not whole: {each}", look="warning") for each in found.faults)
    if found.began_earlier is not None:
        yield Text(text=found.began_earlier, look="quiet")


def _sections(found: WhatIf) -> Iterator[Section]:
    if found.curves:
        yield section("Outputs that differ most", *(_plot(found, name) for name in found.curves))
    if found.outputs:
        rows = [_row(*each) for each in found.outputs.items()]
        yield section("All that differ", table("Differences", _HEADS, rows))
    if found.structure:
        counts = [(what, str(count)) for what, count in found.structure.items()]
        yield section("Not a matter of values", table("Counted", ("what", "count"), counts))


def _plot(found: WhatIf, name: str) -> Series:
    curves = found.curves[name]
    drawn = [
        curve("recorded", curves.recorded),
        curve("replayed", curves.replayed),
    ]
    return Series(name, "s", "", drawn, is_nested=True)
