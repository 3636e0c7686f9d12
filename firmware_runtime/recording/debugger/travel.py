"""Travel in a recording: the robot is run to any section of it, from the keyframe before."""

from bisect import bisect_right
from collections.abc import Iterator
from contextlib import nullcontext, suppress
from typing import Final

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.collection import no_collection
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.functions import Instrument
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import (
    Recording,
    damage,
    kind_of,
    no_instant,
)
from firmware_runtime.recording.blackbox.section import Kind, Section, decode, timed
from firmware_runtime.recording.blackbox.state.keyframes import ForeignState, UnkeepableState
from firmware_runtime.recording.blackbox.taps import output_ports
from firmware_runtime.recording.debugger.last_sent import LastSent
from firmware_runtime.recording.exports.typed_values import value_at
from firmware_runtime.recording.replay.player import Player
from firmware_runtime.recording.replay.rebuilt_robot import foreign_keyframe
from firmware_runtime.recording.replay.stretch import Stretch, segments_of

END: Final = "the recording ends here"
_SNAPSHOT_EVERY: Final = SECOND
"""Time of the run between two states that are kept for going back."""
_TIMED: Final = frozenset({Kind.STEP, Kind.KEYFRAME, Kind.ENDED})


class Travel:
    """`index` sections have been taken; `last` has the value that left each port last, by path."""

    def __init__(self, recording: Recording, board: Board, at: int | None) -> None:
        segment = segments_of(recording, Stretch(at or 0))[0]
        if at is not None and segment.first_at > at:
            raise no_instant(recording, at)
        self._recording, self._board = recording, board
        self.dates = recording.dates()
        self._contents = segment.contents
        self._starts = self._starts_of()
        self._keyframes = self._places_of(Kind.KEYFRAME)
        self._sent = LastSent(self._contents)
        self._states: dict[int, tuple[int, bytes, dict[str, object]]] = {}
        """Instant, state and last values, by how many sections had been taken."""
        self._snapshot_at = 0
        self._takes_keyframes = True
        """True if the recorded states are of this code's models, as far as is known."""
        self.last: dict[str, object] = {}
        self._begin()

    def _begin(self) -> None:
        """Build the robot, and be where the recording begins."""
        first = decode(self._contents[0])
        self.player = Player(self._recording.header, self._board, first)
        self.index = 1
        self.last.clear()

    @property
    def length(self) -> int:
        """Number of sections."""
        return len(self._contents)

    @property
    def ends_with(self) -> str:
        """Sentence where there is nothing further: whether it is the end, or a damage."""
        is_end = kind_of(self._contents[-1]) == Kind.ENDED
        return END if is_end else f"{END}{damage(self._recording)}"

    @property
    def at(self) -> int:
        """The instant of the run that the robot has come to, ns."""
        return self.player.at

    def section(self, index: int) -> Section:
        """The section that is taken when so many have been."""
        return decode(self._contents[index])

    def is_step(self, index: int) -> bool:
        """Return whether the models run in that section."""
        return kind_of(self._contents[index]) == Kind.STEP

    def step_before(self, index: int) -> int | None:
        """The last step before that place; None if there is none to go back to."""
        places = range(index - 1, 0, -1)
        return next((place for place in places if self.is_step(place)), None)

    def check(self, at: int) -> None:
        """Raise ConfigError for an instant before the beginning of it, or after its end."""
        first, last = self._starts[0], self._starts[-1]
        if not first <= at <= last:
            span = f"from {first / SECOND:g} to {last / SECOND:g} s"
            said = f"not in this part of the recording{damage(self._recording)}"
            fault = f"{said}; expected an instant {span}"
            raise ConfigError.of_one(f"{at / SECOND:g} s", fault)

    def index_after(self, at: int) -> int:
        """Count the sections taken when all up to and including an instant have been."""
        return max(1, bisect_right(self._starts, at))

    def take(self, instrument: Instrument | None = None) -> None:
        """Take the next section; its models are called through the instrument."""
        section, player = self.section(self.index), self.player
        is_watched = instrument is not None and section.kind is Kind.STEP
        watched = player.simulator.watched(instrument) if is_watched and instrument else None
        with watched or nullcontext():
            player.take(section)
        self.keep_values()
        self.index += 1
        if section.kind is Kind.STEP and section.at >= self._snapshot_at:
            self._keep_state(section.at)

    def keep_values(self) -> None:
        """Keep what has been sent in this section so far."""
        ports = self.player.ports
        self.last.update((ports[number], value) for number, value in self.player.sent)

    def go_to(self, index: int) -> None:
        """Be where so many sections have been taken."""
        index = min(index, self.length)
        if not self._is_ahead(index):
            self._restore(index)
        with no_collection():
            while self.index < index:
                self.take()

    # ---------------------------------------------------------------------------------------------

    def _starts_of(self) -> list[int]:
        """The instant of each section; of what stands between two steps that of the former."""
        found, latest = [], 0
        for content in self._contents:
            if kind_of(content) in _TIMED:
                latest = max(latest, timed(content).at)
            found.append(latest)
        return found

    def _places_of(self, kind: Kind) -> list[int]:
        """Count the sections taken when each of this kind has been."""
        return [n for n, each in enumerate(self._contents, start=1) if kind_of(each) == kind]

    def _values_before(self, place: int) -> dict[str, object]:
        """The last value of each port before a place, as far back as the recording goes."""
        paths = self._recording.header.ports
        own = output_ports(self.player.simulator.atomics)
        ports = {below_root(port.path): port for port in own}
        forms = self._sent.before(place)
        known = {paths[n]: form for n, form in forms.items() if 0 <= n < len(paths)}
        return {path: value_at(form, ports.get(path)) for path, form in known.items()}

    def _is_ahead(self, index: int) -> bool:
        """Return whether going on is the shortest way there."""
        return self.index <= index and not any(self.index < each <= index for each in self._known())

    def _known(self) -> Iterator[int]:
        """Yield where a state is known, by how many sections have been taken."""
        if self.player.table is not None:
            yield from self._states
        if self.player.table is not None and self._takes_keyframes:
            yield from self._keyframes

    def _restore(self, index: int) -> None:
        """Be in the last state that is known before a place."""
        place = max((each for each in self._known() if each <= index), default=1)
        if place == 1:
            self._begin()
            return
        if place in self._states:
            at, state, last = self._states[place]
        else:
            keyframe = self.section(place - 1)
            at, state, last = keyframe.at, keyframe.extra, self._values_before(place)
        try:
            self.player.go_back(at, state)
        except ForeignState as error:
            if not self._takes_keyframes or kind_of(self._contents[0]) != Kind.BUILD:
                raise foreign_keyframe(error, self.player.code_changed) from error
            self._takes_keyframes = False  # from its start, then
            self._restore(index)
            return
        self.index, self.last = place, dict(last)
        self._snapshot_at = at + _SNAPSHOT_EVERY

    def _keep_state(self, at: int) -> None:
        self._snapshot_at = at + _SNAPSHOT_EVERY
        if self.player.table is not None and self.index not in self._states:
            with suppress(UnkeepableState):  # then it is gone back to from where there was one
                state = self.player.table.capture()
                self._states[self.index] = (at, state, dict(self.last))
