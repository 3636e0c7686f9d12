"""The recorder: listens at the cut around a part while its run goes on.

In a step it appends to a list. Between two steps it writes what the step has left behind as one
batch, with the fields of the part's atomics that have changed, and hands it to a `Sink`. What the
sink does not take is dropped and counted: a batch says how many records there were before it.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from msgspec import to_builtins

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.listening import Listening
from firmware_runtime.devs.ports import AnyPort, OutPort
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MICROSECOND
from firmware_runtime.part_recording.cut import Cut
from firmware_runtime.part_recording.frames import frame
from firmware_runtime.part_recording.records import (
    Batch,
    Ended,
    Entered,
    Header,
    Left,
    Postponed,
    Record,
    Retuned,
    Shown,
    State,
)
from firmware_runtime.part_recording.sink import Sink
from firmware_runtime.part_recording.states import States
from firmware_runtime.recording.values import UnknownValue, legible, pack, plain

MOST: Final = 10_000
"""Records of one step that are kept; further ones are dropped and counted."""
STATES_NEED: Final = 300 * MICROSECOND
"""Ns to the next event without which the fields are left for the next batch, in real time."""

NO_AGES: Final[Mapping[str, int]] = MappingProxyType({})
_WITH_VALUE: Final = (Entered, Left, Retuned)


class Recorder:
    """A hook of the executive that records one part of its model.

    `dropped` counts records that are not in the file; `fault` says of the first why, if it is a
    value that cannot be recorded. `ages` are those of the values that came last over a link, by
    where they cross.
    """

    def __init__(  # noqa: PLR0913 -- put together once, by the run
        self,
        simulator: Simulator,
        cut: Cut,
        header: Header,
        sink: Sink,
        *,
        is_real_time: bool,
        ages: Mapping[str, int] = NO_AGES,
    ) -> None:
        self.dropped = 0
        self.fault: str | None = None
        self._simulator = simulator
        self._sink = sink
        self._needed = STATES_NEED if is_real_time else -1
        self._states = States(cut.atomics)
        self._paths = {atomic: below_root(atomic.path) for atomic in cut.atomics}
        self._pending: list[tuple[type[Any], Any]] = []
        self._records = 0
        self._listenings: list[Listening] = []
        sink.take(frame(pack(to_builtins(header))))
        for number, (crossing, entrance) in enumerate(cut.entrances.items()):
            self._listen_to_entrance(entrance.port, number, crossing, ages)
        for number, port in enumerate(cut.leaving.values()):
            self._listen_to_exit(port, number)
        simulator.on_postponed = self._postponed

    def show(self, port: OutPort[float]) -> None:
        """Record what leaves this port too, for a picture."""

        def remember(at: int, value: object) -> None:
            if isinstance(value, float):
                self._remember(Shown, (at, value))

        self._listenings.append(self._simulator.listen(port, remember))

    def retuned(self, settings: Any) -> None:  # noqa: ANN401 -- the board's own class
        """Record that the part was given these gains and limits now, between two steps."""
        self._remember(Retuned, (self._simulator.now, self._simulator.visit, settings))

    def between_steps(self, _now: int, left: int) -> None:
        """Write down the step that is over."""
        if self._pending:
            self._write(with_states=left >= self._needed)

    def close(self, state: str, reason: str) -> str | None:
        """Record the end of the run; return what is wrong with the recording, if something is."""
        for listening in self._listenings:
            listening.end()
        self._simulator.on_postponed = None
        self._write(with_states=True)
        simulator = self._simulator
        ended = Ended(simulator.now, simulator.visit, state, legible(reason), self._records)
        self._send([ended])
        return self._sink.close() or self.fault or self._dropped()

    def _listen_to_entrance(
        self, port: AnyPort, number: int, crossing: str, ages: Mapping[str, int]
    ) -> None:
        simulator, remember = self._simulator, self._remember

        def enter(at: int, value: object) -> None:
            place = (at, simulator.visit, simulator.round, number)
            remember(Entered, (*place, ages.get(crossing), value))

        self._listenings.append(_listening(simulator, port, enter))

    def _listen_to_exit(self, port: AnyPort, number: int) -> None:
        simulator, remember = self._simulator, self._remember

        def leave(at: int, value: object) -> None:
            remember(Left, (at, simulator.visit, simulator.round, number, value))

        self._listenings.append(_listening(simulator, port, leave))

    def _postponed(self, atomic: Atomic, until: int) -> None:
        path = self._paths.get(atomic)
        if path is not None:
            now, visit = self._simulator.now, self._simulator.visit
            self._remember(Postponed, (now, visit, path, until))

    def _remember(self, kind: type[Any], fields: tuple[Any, ...]) -> None:
        if len(self._pending) < MOST:
            self._pending.append((kind, fields))
        else:
            self._records += 1
            self.dropped += 1

    def _write(self, *, with_states: bool) -> None:
        pending, self._pending = self._pending, []
        records = [made for kind, fields in pending if (made := self._made(kind, fields))]
        if with_states and (changed := self._states.changed()):
            now, visit = self._simulator.now, self._simulator.visit
            records.append(State(now, visit, changed))
        self._send(records)

    def _made(self, kind: type[Any], fields: tuple[Any, ...]) -> Record | None:
        if kind not in _WITH_VALUE:
            made: Record = kind(*fields)
            return made
        try:
            crossed: Record = kind(*fields[:-1], plain(fields[-1]))
        except (UnknownValue, RecursionError) as error:
            self._drop(str(error))
            return None
        return crossed

    def _send(self, records: list[Record]) -> None:
        try:
            content = pack(Batch(self._records, records))
        except UnicodeEncodeError:
            records = [each for each in records if self._can_be_written(each)]
            content = pack(Batch(self._records, records))
        if not self._sink.take(frame(content)):
            self.dropped += len(records)
        self._records += len(records)

    def _can_be_written(self, record: Record) -> bool:
        """Whether it has no text that UTF-8 has not; one that has is dropped."""
        try:
            pack(record)
        except UnicodeEncodeError as error:
            self._drop(f"a text cannot be recorded: {error}")
            return False
        return True

    def _drop(self, fault: str) -> None:
        self.fault = self.fault or fault
        self._records += 1
        self.dropped += 1

    def _dropped(self) -> str | None:
        if self.dropped == 0:
            return None
        return f"{self.dropped} records were dropped: they came faster than they could be written"


def _listening(
    simulator: Simulator, port: AnyPort, listener: Callable[[int, object], None]
) -> Listening:
    """Listen to any port; those of a root that runs alone are input ports."""
    return simulator.listen(port, listener)
