"""Outputs of changed code or settings on what entered: an open loop, as numbers."""

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from msgspec import Struct, field

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.blackbox.section import Section
from firmware_runtime.recording.board_of_recording import changed_board, changed_settings
from firmware_runtime.recording.replay.open_player import Change, OpenPlayer
from firmware_runtime.recording.replay.outputs import Curves, OutputDifference, Outputs
from firmware_runtime.recording.replay.stretch import WHOLE, Stretch
from firmware_runtime.recording.replay.verdict import played


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
    outputs, structure = Outputs(drawn), Counter[str]()
    player = partial(OpenPlayer, recording.header, change, outputs, structure)
    verdict = played(recording, player, stretch, before)
    first = verdict.first
    return WhatIf(
        identical=verdict.is_identical if verdict.steps > 0 else False,
        events=verdict.events,
        duration_s=verdict.duration / SECOND,
        first_difference=None if first is None else first.as_json(recording.dates()),
        differences=verdict.differences,
        steps=verdict.steps,
        outputs=outputs.results(),
        compared=outputs.compared,
        structure=dict(structure),
        failure=verdict.failure,
        faults=verdict.faults,
        run=recording.header.run,
        settings=list(change.board.assignments),
        curves=outputs.curves,
        settings_changed=changed_settings(change.recorded, change.board),
        versions_changed=verdict.versions_changed,
        began_earlier=verdict.began_earlier,
        not_compared=verdict.not_compared,
    )


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
