"""A comparison as a finding: the first difference by model, port and field."""

from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

from firmware_runtime.blackbox.header import Header as RunHeader
from firmware_runtime.certification.finding import Finding, Place
from firmware_runtime.certification.leaves import Leaf, first_leaf
from firmware_runtime.devs.time import SECOND
from firmware_runtime.part_recording.comparison import ABSENT, Comparison
from firmware_runtime.part_recording.recording import Recording
from firmware_runtime.part_recording.replay import Event
from firmware_runtime.recording.code import changed_modules, digest_of
from firmware_runtime.recording.values import UnknownValue, encoded
from firmware_runtime.replay.difference import Difference, in_words
from firmware_runtime.replay.verdict import Verdict

_NO_EVENT: Final = encoded(ABSENT)


class _Parting(NamedTuple):
    """Two values that are not the same bytes."""

    what: str
    at: int
    name: str
    recorded: bytes
    replayed: bytes


def finding_of(recording: Recording, comparison: Comparison, code: Mapping[str, str]) -> Finding:
    """A comparison of a recording with its replay by this code, but for the file's name."""
    header, ended = recording.header, recording.ended
    places = [_place(each) for each in _partings(comparison)]
    return Finding(
        recording="",
        sha256="",
        board=header.board,
        made_with=header.versions,
        duration_s=0.0 if ended is None else ended.at / SECOND,
        events=comparison.events,
        inputs=comparison.inputs,
        fields=comparison.fields,
        differences=comparison.differences,
        first=min(places, key=lambda place: place.t_ns, default=None),
        first_output=next((each for each in places if each.what == "output"), None),
        fault=comparison.fault,
        code_sha256=digest_of(code),
        code_changed=changed_modules(header.code, code),
        has_drawn=comparison.has_drawn,
    )


def finding_of_run(header: RunHeader, verdict: Verdict, code: Mapping[str, str]) -> Finding:
    """The verdict on the recording of a whole run, but for the file's name."""
    place = None if verdict.first is None else _place_of_run(verdict.first)
    return Finding(
        recording="",
        sha256="",
        board=header.board,
        made_with=header.versions,
        duration_s=verdict.duration / SECOND,
        events=verdict.events,
        steps=verdict.steps,
        transfers=verdict.writes,
        differences=verdict.differences,
        first=place,
        first_output=place if place is not None and place.what == "value" else None,
        fault="; ".join([*verdict.faults, *verdict.not_compared])
        or (None if verdict.is_something else "nothing was run again"),
        code_sha256=digest_of(code),
        code_changed=changed_modules(header.code, code),
        has_drawn=verdict.has_drawn,
    )


def _partings(comparison: Comparison) -> Iterator[_Parting]:
    """Where it differs, cause before effect."""
    if (entered := comparison.input) is not None:
        yield _Parting("input", entered.at, entered.port, entered.recorded, entered.replayed)
    if (state := comparison.state) is not None:
        yield _Parting("state", state.at, state.field, state.recorded, state.replayed)
    if (first := comparison.first) is not None:
        sides = map(_content, (first.recorded, first.replayed))
        yield _Parting("output", first.at, first.port, *sides)


def _place(parting: _Parting) -> Place:
    leaf = first_leaf(parting.recorded, parting.replayed)
    model, _, name = parting.name.rpartition(".")
    is_state = parting.what == "state"
    return Place(
        what=parting.what,
        t_ns=parting.at,
        model=model,
        port=None if is_state else name,
        field=".".join(filter(None, (name, leaf.path))) if is_state else leaf.path,
        recorded=leaf.recorded,
        replayed=leaf.replayed,
        units_apart=leaf.units_apart,
    )


def _place_of_run(difference: Difference) -> Place:
    """The first difference of a whole run; a value with fields by the first that differs."""
    try:
        leaf = first_leaf(*map(encoded, (difference.recorded, difference.replayed)))
    except UnknownValue:
        leaf = Leaf("", in_words(difference.recorded), in_words(difference.replayed), None)
    is_value = difference.what == "value"
    names = (leaf.path,) if is_value else (difference.field, leaf.path)
    return Place(
        what=difference.what,
        t_ns=difference.at,
        model=difference.model,
        port=difference.field if is_value else None,
        field=".".join(filter(None, names)),
        recorded=leaf.recorded,
        replayed=leaf.replayed,
        units_apart=leaf.units_apart,
    )


def _content(event: Event | None) -> bytes:
    return _NO_EVENT if event is None else event.content
