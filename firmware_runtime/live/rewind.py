"""A recorded run, instant by instant, forwards and backwards: what happened, and its state then.

The file is read once, also that of a run under way, which neither waits nor notices. The models are
run again by the debugger's `Travel`, from a keyframe or a state that it has kept. Where they cannot
be run again here, all that the recording itself says of an instant is still there, and `note` says
what is missing and why.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from threading import Lock
from typing import Any, Final

from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import MICROSECOND, SECOND, format_time
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, raised_words, text_of
from firmware_runtime.live.called import Called, brief, event_of
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import (
    DISCARD,
    READ,
    WRITE,
    Kind,
    Section,
    Transfer,
    decode,
    sent_in,
    timed,
)
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.debugger.last_sent import LastSent
from firmware_runtime.recording.debugger.travel import Travel
from firmware_runtime.recording.exports.mcap_file import marker_of
from firmware_runtime.recording.replay.difference import shown
from firmware_runtime.recording.values import numbers_in

_KEPT: Final = 256
"""Instants that are not run again when they are looked at once more."""
_BACK: Final = 16
"""Instants that are looked at together where one goes back from one to the one before."""
_USES: Final = {WRITE: "write", READ: "read", DISCARD: "discard"}


class _Instant(Struct, frozen=True):
    """Places in the whole file of an instant's sections."""

    at: int
    before: int
    """The first that is shown with it."""
    begin: int
    """Its first step."""
    steps: int
    """Behind its last step."""
    until: int
    """Behind all that is shown with it."""


class Rewind:
    """The recording at `path`, from `begin_ns` to `end_ns` of its run; may be used by threads.

    Raises ConfigError for what is no recording, and for one without a step.
    """

    def __init__(self, path: Path) -> None:
        self._recording = recording = read_recording(path)
        self._contents = [each for each in recording.contents() if kind_of(each) != Kind.HEADER]
        self._instants = list(_instants_of(self._contents))
        if not self._instants:
            raise ConfigError.of_one(str(path), "no step of a run is in it; expected one or more")
        self._ats = [each.at for each in self._instants]
        self.begin_ns, self.end_ns = self._ats[0], self._ats[-1]
        self.faults: list[str] = recording.faults()
        """Sentences of what is missing in it, as where its run wrote over it meanwhile."""
        self._segments = recording.segments()
        self._place_of = {
            id(content): (number, place)
            for number, segment in enumerate(self._segments)
            for place, content in enumerate(segment.contents)
        }
        self._last = LastSent(self._contents)
        self._travels: dict[int, Travel | str] = {}
        """By segment: where its models are, or why they cannot be run again."""
        self._found: dict[int, dict[str, Any]] = {}
        self._lock = Lock()
        self._board: Board | None = None
        self._no_board: str | None = None
        try:
            self._board = board_of(recording.header)
        except ConfigError as error:
            self._no_board = text_of(error)

    def instant(self, at_ns: int) -> dict[str, Any]:
        """What happened at the last instant that is not after `at_ns`, in JSON's types.

        Of `events` each has the state that it left its model in, the names of what is `changed` of
        it, and what it sent. `states`,
        `sigma_s` (s until the next internal event) and `values` are those after all of them,
        `transfers` also those before the next instant. `lateness_us` is None in virtual time.
        """
        with self._lock:
            index = max(0, bisect_right(self._ats, at_ns) - 1)
            if index not in self._found:
                first = max(0, index + 1 - _BACK) if index + 1 in self._found else index
                for each in range(first, index + 1):
                    self._found[each] = self._at(each)
                while len(self._found) > _KEPT:
                    self._found.pop(next(iter(self._found)))
            return self._found[index]

    def _at(self, index: int) -> dict[str, Any]:
        it = self._instants[index]
        sections = [decode(each) for each in self._contents[it.before : it.until]]
        steps = [each for each in sections if each.kind is Kind.STEP]
        return {
            "begin_ns": self.begin_ns,
            "end_ns": self.end_ns,
            "at": it.at,
            "index": index,
            "previous": self._ats[index - 1] if index else None,
            "next": self._ats[index + 1] if index + 1 < len(self._ats) else None,
            **self._models_at(it),
            "transfers": [self._transfer(each) for one in sections for each in one.transfers],
            "marks": [marked for each in sections if (marked := _mark(each)) is not None],
            "lateness_us": _lateness(steps[0]),
            "entered": [
                [name, brief(shown(numbers_in(form)))]
                for step in steps
                for name, form in step.entered
            ],
        }

    # What is run again ----------------------------------------------------------------------------

    def _models_at(self, it: _Instant) -> dict[str, Any]:
        """Events, states and values; without the models the values as they are recorded."""
        try:
            travel = self._travel_to(it)
            called = Called(travel)
            for _ in range(it.begin, it.steps):
                travel.take(called.instrument)
            found = called.after()
        except Exception as error:  # noqa: BLE001 -- of a state that something has changed
            is_ours = isinstance(error, FirmwareRuntimeError)
            said = text_of(error) if is_ours else raised_words(error)
            why = f"the models cannot be run again here: {said}"
            return {
                "events": self._recorded_events(it),
                "states": {},
                "sigma_s": {},
                "values": self._recorded_values(it.steps),
                "note": why,
            }
        return {**found, "note": _note(travel)}

    def _travel_to(self, it: _Instant) -> Travel:
        """Be before the first step of an instant. Raises ConfigError where that cannot be."""
        known = self._place_of.get(id(self._contents[it.begin]))
        if self._board is None:
            raise ConfigError("replay", [self._no_board or "no board"])
        if known is None:
            why = self._recording.no_keyframe() or "no keyframe is before it"
            raise ConfigError.of_one(f"{it.at / SECOND:g} s", why)
        number, place = known
        travel = self._travels.get(number)
        if travel is None:
            at = self._segments[number].last_at
            try:
                travel = Travel(self._recording, self._board, at)
            except ConfigError as error:
                travel = text_of(error)
            self._travels[number] = travel
        if isinstance(travel, str):
            raise ConfigError("replay", [travel])
        travel.go_to(place)
        return travel

    # What is recorded -----------------------------------------------------------------------------

    def _recorded_events(self, it: _Instant) -> list[dict[str, Any]]:
        """What each model sent, which is all that is known of it without running it again."""
        events: list[dict[str, Any]] = []
        for content in self._contents[it.begin : it.steps]:
            for number, form in sent_in(content):
                path, sent = self._path(number), [self._path(number), _of_form(form)]
                model = path.rpartition(".")[0]
                if events and events[-1]["model"] == model:
                    events[-1]["sent"].append(sent)
                else:
                    events.append(event_of(model, "output", [sent]))
        return events

    def _recorded_values(self, place: int) -> dict[str, Any]:
        found = self._last.before(place)
        return {self._path(number): _of_form(form) for number, form in found.items()}

    def _path(self, number: int) -> str:
        paths = self._recording.header.ports
        return paths[number] if 0 <= number < len(paths) else str(number)

    def _transfer(self, transfer: Transfer) -> dict[str, Any]:
        line, asked = self._recording.header.lines[transfer.line], transfer.messages
        messages = [asked] if isinstance(asked, bytes) else asked
        is_bus = transfer.address >= 0
        return {
            "line": line,
            "address": transfer.address if is_bus else None,
            "device": self._device(line, transfer.address) if is_bus else line,
            "use": _USES.get(transfer.address, "transaction"),
            "written": " ".join(each.hex() for each in messages if isinstance(each, bytes)),
            "read": "" if transfer.failed else bytes(transfer.answer).hex(),
            "error": ": ".join(map(str, transfer.answer)) if transfer.failed else None,
            "at": transfer.at,
        }

    def _device(self, line: str, address: int) -> str | None:
        devices = () if self._board is None else self._board.devices
        found = (
            f"{each.key} ({each.chip})"
            for each in devices
            if (each.bus, each.address) == (line, address)
        )
        return next(found, None)


def _of_form(form: object) -> Any:  # noqa: ANN401 -- as above
    """A recorded value: of a record its fields, whose names the model alone knows."""
    return brief(shown(numbers_in(form)))


def _note(travel: Travel) -> str | None:
    """Say where this is not what the run did."""
    player, notes = travel.player, list[str]()
    if player.failure is not None:
        notes.append(f"a model raised {raised_words(player.failure)}")
    if (first := player.first) is not None and first.at <= player.at:
        since = format_time(first.at)
        notes.append(f"not as recorded: {first.what} of {first.where}, since {since}")
    if changed := player.code_changed:
        notes.append(f"code that has changed since the run: {', '.join(changed)}")
    return "; ".join(notes) or None


def _lateness(step: Section) -> float | None:
    return (step.readings[0] - step.at) / MICROSECOND if step.readings else None


def _mark(section: Section) -> dict[str, Any] | None:
    """What a section that is no step says, in words."""
    marked = marker_of(section)
    return None if marked is None else {"what": ": ".join(filter(None, marked)), "at": section.at}


def _instants_of(contents: Sequence[bytes]) -> Iterator[_Instant]:
    """The instants of all steps: what stands between two belongs to the one before it."""
    places = [place for place, each in enumerate(contents) if kind_of(each) == Kind.STEP]
    at_once = groupby(places, lambda place: timed(contents[place]).at)
    groups = [(at, list(group)) for at, group in at_once]
    ends = [group[0] for _, group in groups[1:]] + [len(contents)]
    before = 0
    for (at, group), until in zip(groups, ends, strict=False):  # without a step there is an end
        yield _Instant(at, before, group[0], group[-1] + 1, until)
        before = until
