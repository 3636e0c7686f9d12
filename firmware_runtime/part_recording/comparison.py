"""The comparison of a run with its replay: every output event, by instant, port and value.

Values are compared as bytes, so floats to the bit: 0.0 is not -0.0, and a NaN is itself.
"""

from collections import defaultdict
from dataclasses import dataclass
from typing import Any, Final

import msgspec

from firmware_runtime.part_recording.recording import Recording
from firmware_runtime.part_recording.replay import Event, InputDifference, Replayed, StateDifference
from firmware_runtime.recording.values import Plain, UnknownValue, made, unpack
from firmware_runtime.statistics.trace_file import plain as shown

ABSENT: Final = "no event"


@dataclass(frozen=True, slots=True)
class Difference:
    """An output event that is not the same on both sides; `None` where there is none."""

    at: int
    port: str
    recorded: Event | None
    replayed: Event | None

    def as_json(self, state: StateDifference | None) -> dict[str, Any]:
        """For a program, with the field of the part's state that differed first."""
        return {
            "t_ns": self.at,
            "port": self.port,
            "recorded": _shown_event(self.recorded),
            "replayed": _shown_event(self.replayed),
            "state": None if state is None else _shown_state(state),
        }


@dataclass(frozen=True, slots=True)
class Comparison:
    """What a run and its replay have in common."""

    events: int
    """Output events recorded."""
    inputs: int
    """Values that entered."""
    differences: int
    first: Difference | None
    state: StateDifference | None
    fault: str | None
    """What keeps the comparison from meaning anything, in a sentence."""
    input: InputDifference | None = None
    """The first value that did not enter as it was recorded."""
    fields: int = 0
    """Recorded fields of the state that were compared."""
    has_drawn: bool = False
    """Whether the replay drew from the process's own generators of random numbers."""

    @property
    def is_equal(self) -> bool:
        """Whether there were output events, all of them the same, and nothing is missing."""
        return self.differences == 0 and self.fault is None

    def as_json(self) -> dict[str, Any]:
        """For a program."""
        return {
            "events": self.events,
            "differences": self.differences,
            "first_difference": None if self.first is None else self.first.as_json(self.state),
            "inputs": self.inputs,
            "fault": self.fault,
            "has_drawn": self.has_drawn,
        }


def compare(recording: Recording, replayed: Replayed) -> Comparison:
    """Compare every output event of a run with those of its replay."""
    ended = recording.ended
    if ended is not None and ended.state == "failed":  # its last step was not finished
        last = ended.at
        replayed.replayed = _as_far(replayed.replayed, replayed.recorded, last)
    first, count = None, 0
    pairs = _by_port(replayed.recorded), _by_port(replayed.replayed)
    for key in sorted(pairs[0].keys() | pairs[1].keys()):
        for difference in _differences(key, pairs[0].get(key, []), pairs[1].get(key, [])):
            count += 1
            first = first or difference
    fault = _fault(recording, replayed)
    return Comparison(
        events=len(replayed.recorded),
        inputs=replayed.inputs,
        differences=count,
        first=first,
        state=replayed.state,
        fault=fault,
        input=replayed.input,
        fields=replayed.fields,
    )


def _as_far(events: list[Event], recorded: list[Event], last: int) -> list[Event]:
    """What a run that failed in an instant could still send in it."""
    before = [event for event in events if event.at < last]
    at_last = sum(event.at == last for event in recorded)
    return before + [event for event in events if event.at == last][:at_last]


def _fault(recording: Recording, replayed: Replayed) -> str | None:
    if (missing := recording.incomplete()) is not None:
        return missing
    ended, failure = recording.ended, replayed.failure
    has_failed = ended is not None and ended.state == "failed"
    if failure is not None and not has_failed:
        return f"the replay failed: {failure}"
    return None if replayed.recorded else "nothing left the part, so nothing was compared"


def _by_port(events: list[Event]) -> dict[tuple[int, str], list[Event]]:
    found: defaultdict[tuple[int, str], list[Event]] = defaultdict(list)
    for event in events:
        found[event.at, event.port].append(event)
    return found


def _differences(
    key: tuple[int, str], recorded: list[Event], replayed: list[Event]
) -> list[Difference]:
    found: list[Difference] = []
    for number in range(max(len(recorded), len(replayed))):
        was = recorded[number] if number < len(recorded) else None
        now = replayed[number] if number < len(replayed) else None
        if was is None or now is None or was.content != now.content:
            found.append(Difference(*key, was, now))
    return found


def _shown_event(event: Event | None) -> object:
    return ABSENT if event is None else _shown(event.value)


def _shown_state(state: StateDifference) -> dict[str, Any]:
    return {
        "field": state.field,
        "t_ns": state.at,
        "recorded": _shown_content(state.recorded),
        "replayed": _shown_content(state.replayed),
    }


def _shown_content(content: bytes) -> object:
    try:
        return _shown(unpack(content))
    except msgspec.MsgspecError:
        return repr(content)


def _shown(value: Plain) -> object:
    try:
        return shown(made(value))
    except UnknownValue:
        return repr(value)
