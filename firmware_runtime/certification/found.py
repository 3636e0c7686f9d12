"""A comparison as a finding: the first difference by model, port and field."""

from collections.abc import Iterator, Mapping
from typing import Any, Final, Literal, NamedTuple

from firmware_runtime.certification.finding import Finding, Place
from firmware_runtime.certification.leaves import first_leaf
from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.code import digest_of
from firmware_runtime.recording.comparison import ABSENT, Comparison
from firmware_runtime.recording.of_board import code_changes
from firmware_runtime.recording.recording import Recording
from firmware_runtime.recording.replay import Event
from firmware_runtime.recording.values import encoded

_NO_EVENT: Final = encoded(ABSENT)


class _Parting(NamedTuple):
    """Two values that are not the same bytes."""

    what: Literal["input", "state", "output"]
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
        code_sha256=digest_of(dict(code)),
        code_changed=code_changes(recording, dict(code)),
    )


def finding_of_document(said: Mapping[str, Any]) -> Finding:
    """What `replay --json` said of a recording, as a finding, but for the file's name."""
    first = said.get("first_difference")
    place = None if first is None else _place_of_document(first)
    is_identical = said.get("identical", said.get("equal")) is True
    fault = said.get("fault")
    if not is_identical and place is None and fault is None:
        fault = "its replay is not identical and names no difference"
    return Finding(
        recording="",
        sha256="",
        board=str(said.get("board", "")),
        made_with=said.get("versions") or {},
        duration_s=float(said.get("duration_s", 0.0)),
        events=int(said.get("events", 0)),
        inputs=int(said.get("inputs", 0)),
        fields=int(said.get("fields", 0)),
        differences=int(said.get("differences", 0 if is_identical else 1)),
        first=place,
        first_output=place if place is not None and place.what == "output" else None,
        fault=fault,
        code_sha256=said.get("code_sha256"),
        code_changed=said.get("code_changed") or [],
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


def _place_of_document(first: Mapping[str, Any]) -> Place:
    """The first difference as a program was told it: of a field if one is named, else of a port."""
    state = first.get("state")
    of_state = state if isinstance(state, Mapping) else first
    is_state = of_state is not first or first.get("field") is not None
    model, _, port = str(first.get("port") or "").rpartition(".")
    field = str(of_state.get("field") or "")
    owner, _, attribute = field.rpartition(".")
    return Place(
        what="state" if is_state else "output",
        t_ns=int(of_state.get("t_ns", first.get("t_ns", 0))),
        model=str(of_state.get("model") or (owner if is_state else model)),
        port=None if is_state else port or None,
        field=attribute if is_state else "",
        recorded=str(of_state.get("recorded")),
        replayed=str(of_state.get("replayed")),
    )


def _content(event: Event | None) -> bytes:
    return _NO_EVENT if event is None else event.content
