"""Outputs of changed code or settings on what entered: an open loop, as numbers."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

from msgspec import Struct, field

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.blackbox.section import Kind, Section
from firmware_runtime.recording.board_of_recording import changed_board, changed_settings
from firmware_runtime.recording.recorded_board import changed_versions
from firmware_runtime.recording.replay.open_player import Change, OpenPlayer
from firmware_runtime.recording.replay.outputs import Curves, OutputDifference, Outputs
from firmware_runtime.recording.replay.verdict import (
    WHOLE,
    Stretch,
    began_earlier,
    segments_of,
    stretch_of,
)
from firmware_runtime.statistics.number_formats import Dates


class WhatIf(Struct):
    """Findings. `first_difference` is as `Difference.as_json` has it."""

    identical: bool | None
    """None where nothing differs, but not all that left the models was compared."""
    events: int
    duration_s: float
    first_difference: dict[str, Any] | None
    differences: int
    steps: int
    outputs: dict[str, OutputDifference]
    """Outputs that differ, most first."""
    compared: int
    """Outputs that were compared."""
    structure: dict[str, int]
    """Differences that are no matter of values: how often."""
    failure: str | None
    """Error of the changed code, which ended it."""
    faults: list[str]
    run: str
    settings: list[str]
    """Settings that were set otherwise than in the run."""
    curves: dict[str, Curves] = field(default_factory=dict)
    settings_changed: dict[str, dict[str, object]] = field(default_factory=dict)
    """Settings that differ for it, as `changed_settings` has it."""
    versions_changed: dict[str, dict[str, str | None]] = field(default_factory=dict)
    """Python and packages that are others where this was found, as `changed_versions` has them."""
    began_earlier: str | None = None
    """As a verdict has it."""
    not_compared: list[str] = field(default_factory=list)
    """As a verdict has it."""


def what_if(
    recording: Recording,
    change: Change,
    stretch: Stretch = WHOLE,
    *,
    before: Callable[[Section], None] = lambda _: None,
    drawn: Collection[str] = (),
) -> WhatIf:
    """Run changed code or settings on a recording; curves of those outputs that are `drawn`.

    Raises ConfigError where it cannot begin.
    """
    segments = segments_of(recording, stretch)
    outputs = Outputs(drawn)
    found = WhatIf(
        *(False, 0, 0.0, None, 0, 0, {}, 0, {}, None),
        faults=recording.faults(),
        run=recording.header.run,
        settings=list(change.board.assignments),
        versions_changed=changed_versions(recording.header.versions),
        settings_changed=changed_settings(change.recorded, change.board),
        began_earlier=began_earlier(recording, segments, stretch.begin),
    )
    structure: Counter[str] = Counter()
    dates = recording.dates()
    for segment in segments:
        sections = segment.from_instant(stretch.begin).sections()
        player = OpenPlayer(recording.header, change, first := next(sections), outputs)
        found.failure = _played(player, stretch_of(sections, stretch.until), before)
        _add(found, player, first.at, dates)
        structure += player.structure
        if found.failure is not None:
            break
    found.structure = dict(structure)
    found.outputs, found.compared = outputs.results(), outputs.compared
    found.curves = outputs.curves
    found.identical = found.steps > 0 and found.differences == 0 and not found.faults
    if found.identical and found.not_compared:
        found.identical = None
    return found


def _played(
    player: OpenPlayer, sections: Iterable[Section], before: Callable[[Section], None]
) -> str | None:
    """Take sections; what the changed code raised before the end of the run, which ended it."""
    for section in sections:
        before(section)
        player.take(section)
        if player.failure is not None and section.kind is not Kind.ENDED:
            return text_of(player.failure)
    return None


def _add(found: WhatIf, player: OpenPlayer, begin: int, dates: Dates) -> None:
    found.events += player.events
    found.steps += player.steps
    found.duration_s += max(0, player.at - begin) / SECOND
    found.differences += player.differences
    found.not_compared += player.values.not_compared()
    found.faults += [] if player.missing is None else [player.missing]
    if found.first_difference is None and player.first is not None:
        found.first_difference = player.first.as_json(dates)


def most_different(found: WhatIf, count: int) -> Sequence[str]:
    """Outputs that are worth a plot, most different first."""
    numbers = [name for name, each in found.outputs.items() if each.max is not None]
    return numbers[:count]


class Question(Struct, kw_only=True):
    """Question to a recording."""

    recording: str
    """The file's path."""
    assignments: list[str] = []
    begin: int = 0
    until: int = NEVER
    plots: int = 0
    """Number of outputs of which curves are wanted."""


def answer(
    question: Question,
    before: Callable[[Section], None] = lambda _: None,
    board: Board | None = None,
) -> WhatIf:
    """Find it out, by the code of this process; `board` in place of the run's and what is set.

    Raises ConfigError.
    """
    recording = read_recording(Path(question.recording))
    stretch = Stretch(question.begin, question.until)
    change = _change(question, recording, board)
    found = what_if(recording, change, stretch, before=before)
    found.settings = question.assignments
    if question.plots and not found.identical:
        drawn = frozenset(most_different(found, question.plots))
        found.curves = what_if(recording, change, stretch, before=before, drawn=drawn).curves
    return found


def _change(question: Question, recording: Recording, board: Board | None) -> Change:
    header = recording.header
    if board is not None and board.kind != header.kind:
        fault = f"a recording of a {header.kind}; expected settings of one, not of a {board.kind}"
        raise ConfigError.of_one("replay", fault)
    return Change(board or changed_board(header, question.assignments), changed_board(header, ()))
