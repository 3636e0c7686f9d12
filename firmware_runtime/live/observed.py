"""A run as one sees it: values of all ports and states of all models, over time.

Nothing of it comes from the run itself. What the run records at its edges is run again here, in
this process, by the same code, and that is observed: the values that leave ports, and what each
model is in. Where the run cannot be run again here (other code, a state that cannot be set) the
values are those that it recorded, there are no states, and `remark` says why.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final, TypeAlias

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import FirmwareRuntimeError, text_of
from firmware_runtime.live.follower import Follower
from firmware_runtime.live.trace import States, Trace
from firmware_runtime.recording.blackbox.reader import BEGINNINGS
from firmware_runtime.recording.blackbox.section import Kind, Section, decode
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.observed_run import Moment, Observer
from firmware_runtime.recording.exports.typed_values import (
    Port,
    Sent,
    model_of,
    ports_of,
    values_in,
)
from firmware_runtime.recording.replay.player import Player
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.statistics.value_table import cells_of
from firmware_runtime.system.resources import Closing

BEFORE: Final = 6_000
"""Steps of a run under way that are run again at first."""
AT_ONCE: Final = 500
"""Sections of a run under way that are taken at once; then it is shown how far that is."""
MOST_BEHIND: Final = 2
"""Chunks of the recording that this may fall behind the run; then it goes on at its present."""

Listener: TypeAlias = Callable[[int, str, object], None]


class Observed(Closing):
    """What the recording at `path` shows, as far as it has been read. Raises ConfigError.

    `is_whole` runs all of it again, not just the last few thousand steps. `listeners` are called
    with each value: instant, port, value.
    """

    def __init__(
        self, path: Path, *, is_whole: bool = False, listeners: Sequence[Listener] = ()
    ) -> None:
        self._follower = Follower(path)
        self._listeners = listeners
        self.header = self._follower.header
        self.board: Board = board_of(self.header)
        self.model = model_of(self.header, self.board)
        self.ports: dict[str, Port] = ports_of(self.model)
        self.at = 0
        """The instant of the run that has come, ns."""
        self.values: dict[str, object] = {}
        """What left each port last, in JSON's types."""
        self.states: dict[str, str] = {}
        self.numbers: dict[str, Trace] = {}
        """By leaf: a port's path, and the name of a field behind it."""
        self.words: dict[str, States] = {}
        """By model, and by leaf where its values are words."""
        self.remark: str | None = None
        """Why this is not all that there is to see; None where it is."""
        self.is_off = False
        """Whether its outputs have been switched off since its last step."""
        self.end: str | None = None
        """How the run ended, as it recorded it."""
        self._is_whole = is_whole
        self._observer: Observer | None = None
        self._can_run_again = True
        """False once that has failed; behind a gap it is tried again."""
        self._most_behind: int | None = None
        """Chunks that this may be behind the run; None before it has been looked at."""

    def close(self) -> None:
        """Close the file."""
        self._follower.close()

    @property
    def statistics(self) -> Statistics | None:
        """What was counted as it was run again; None where it was not."""
        return None if self._observer is None else self._observer.player.statistics

    @property
    def is_replaced(self) -> bool:
        """Whether another run has begun in the place of this one."""
        return self._follower.is_replaced

    def poll(self) -> bool:
        """Take what is new, of a run under way not all at once; return whether there was any."""
        self._skip_what_is_too_much()
        number = 0
        for number, content in enumerate(self._follower.sections(), start=1):
            if content is None:
                self._begin_again("is missing, or was written over before it was read")
            else:
                self._take(decode(content))
            if number == AT_ONCE and not self._is_whole:
                break
        return number > 0

    def _skip_what_is_too_much(self) -> None:
        follower = self._follower
        if self._most_behind is None:
            if not self._is_whole:
                follower.skip_to_beginning(BEFORE)
            self._most_behind = follower.chunks_behind + MOST_BEHIND
        elif follower.chunks_behind > self._most_behind:
            follower.skip_to_beginning(0)
            self._begin_again("was left out, as this page was too slow")

    # What is in a section -------------------------------------------------------------------------

    def _begin_again(self, how: str) -> None:
        """Run it again from the next keyframe on, behind a part that cannot be."""
        self._observer, self._can_run_again = None, True
        self.remark = f"after {self.at / SECOND:g} s a part of the recording {how}"

    def _take(self, section: Section) -> None:
        if section.kind is Kind.ENDED and isinstance(section.extra, dict):
            self.end = f"{section.extra.get('state')}: {section.extra.get('reason')}"
        if section.kind in {Kind.SAFE, Kind.STEP}:
            self.is_off = section.kind is Kind.SAFE
        if section.kind is Kind.LOST:
            self._begin_again("is missing")
            return
        if self._observer is None and self._may_begin(section):
            self._begin(section)
            return
        moment = self._observed(section)
        if section.has_instant:
            self.at = max(self.at, section.at)
        for sent in self._recorded(section) if moment is None else moment.sent:
            self.note(sent.at, sent.port, plain(sent.value))
        self._note_states()

    def _may_begin(self, section: Section) -> bool:
        return section.kind in BEGINNINGS and self._can_run_again

    def _begin(self, section: Section) -> None:
        """Run it again from here."""
        try:
            self._observer = Observer(Player(self.header, self.board, section))
        except FirmwareRuntimeError as error:
            self._give_up(error)
        else:
            self._note_states()

    def _observed(self, section: Section) -> Moment | None:
        """Run a section again; None where that cannot be done."""
        if self._observer is None:
            return None
        try:
            return self._observer.take(section)
        except (FirmwareRuntimeError, MemoryError) as error:
            self._give_up(error)
            return None

    def _give_up(self, error: BaseException) -> None:
        self._observer, self._can_run_again = None, False
        self.states.clear()
        self.remark = f"not run again here, so no state of a model is shown: {text_of(error)}"

    def _recorded(self, section: Section) -> Iterator[Sent]:
        return values_in(section, self.header.ports, self.ports)

    def note(self, at: int, port: str, value: object) -> None:
        """Note a value in JSON's types that a port had at an instant, ns."""
        self.values[port] = value
        for listener in self._listeners:
            listener(at, port, value)
        at_s = at / SECOND
        for leaf, cell in cells_of(value, port):
            if isinstance(cell, int | float):  # a truth value is 0 or 1
                trace = self.numbers.get(leaf)
                if trace is None:
                    trace = self.numbers[leaf] = Trace()
                trace.add(at_s, float(cell))
            elif isinstance(cell, str):
                self.words.setdefault(leaf, States()).enter(at_s, cell)

    def _note_states(self) -> None:
        if self._observer is None:
            return
        for path, atomic in self._observer.atomics.items():
            state = atomic.phase
            if self.states.get(path) != state:
                self.states[path] = state
                self.words.setdefault(path, States()).enter(self.at / SECOND, state)
