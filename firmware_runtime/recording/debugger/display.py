"""State of the debugger and of models, as lines and as JSON."""

from collections.abc import Iterator
from typing import Any, Final

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER, SECOND, format_time
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.debugger.debugger import Debugger
from firmware_runtime.recording.debugger.model_state import state_of, value_of
from firmware_runtime.recording.replay.difference import shown
from firmware_runtime.recording.values import UnknownValue, plain

_LONGEST: Final = 200


def where_json(debugger: Debugger, reason: str) -> dict[str, object]:
    """Return the place of the debugger."""
    event, first = debugger.event, debugger.travel.player.first
    dates = debugger.travel.dates
    return {
        "t_ns": debugger.at,
        "t_s": debugger.at / SECOND,
        **dates.as_json(debugger.at),
        "reason": reason,
        "event": debugger.place.event,
        "model": None if event is None else event.path,
        "function": None if event is None else event.function,
        "first_difference": None if first is None else first.as_json(dates),
    }


def where_text(debugger: Debugger, reason: str) -> Iterator[str]:
    """The same in words."""
    place, first = debugger.place, debugger.travel.player.first
    dates = debugger.travel.dates
    event = f", event {place.event} of the instant" if place.event else ""
    yield f"at {format_time(debugger.at)}{dates.said(debugger.at)}{event}: {reason}"
    if not place.event and (due := debugger.travel.player.simulator.next_at) < NEVER:
        yield f"  next internal event at {format_time(due)}"
    if first is not None:
        since = f"{format_time(first.at)}{dates.said(first.at)}"
        yield f"  not as recorded: {first.what} of {first.where}, since {since}"


def printed_json(debugger: Debugger, path: str) -> dict[str, object]:
    """State and ports of a model, or of all below it; or one value. Raises ConfigError."""
    name, words = debugger.models.split(path)
    if words:
        return {"t_ns": debugger.at, "path": path, "value": as_json(_value(debugger, name, words))}
    found = {
        each: {
            "state": {field: as_json(value) for field, value in state_of(atomic).items()},
            "ports": ports_of(debugger, each),
        }
        for each, atomic in debugger.models.atomics(name)
    }
    whole = isinstance(debugger.models.component(name), Coupled)
    inner = {"models": found} if whole else found[name]
    return {"t_ns": debugger.at, "path": path, **inner}


def printed_text(debugger: Debugger, path: str) -> Iterator[str]:
    """The same as lines. Raises ConfigError."""
    name, words = debugger.models.split(path)
    if words:
        yield f"{path} = {as_text(_value(debugger, name, words))}"
        return
    for each, atomic in debugger.models.atomics(name):
        yield f"{each} ({type(atomic).__name__})"
        for field, value in state_of(atomic).items():
            yield f"  {field} = {_span(value) if field == 'sigma' else as_text(value)}"
        yield from (f"  {line}" for line in ports_text(debugger, each))


def ports_of(debugger: Debugger, path: str) -> dict[str, object]:
    """The last value of each output port; null where nothing is known to have left it."""
    component = debugger.models.component(path)
    last = debugger.travel.last
    keys = {name: _sender(debugger, path, name) for name in component.out_ports}
    return {name: as_json(None if key is None else last.get(key)) for name, key in keys.items()}


def ports_text(debugger: Debugger, path: str) -> Iterator[str]:
    """Ports of a model, with the last value of those that send."""
    component = debugger.models.component(path)
    for name in component.in_ports:
        yield f"{name}?"
    for name in component.out_ports:
        key, last = _sender(debugger, path, name), debugger.travel.last
        yield f"{name}! {as_text(last[key]) if key in last else '-'}"


def as_text(value: object) -> str:
    """A value, cut where it is long."""
    try:
        text = repr(value)
    except Exception as error:  # noqa: BLE001 -- the model's own
        text = f"{type(value).__name__} (its repr raised {type(error).__name__})"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def as_json(value: object) -> object:
    """A value as JSON has it; as text what it has no words for."""
    try:
        return shown(plain(value))
    except UnknownValue:
        return as_text(value)


def _value(debugger: Debugger, name: str, words: list[str]) -> Any:  # noqa: ANN401 -- any
    component = debugger.models.component(name)
    if words[0] in component.out_ports:
        key = debugger.models.sender(name, words[0])
        if key not in debugger.travel.last:
            fault = "has sent nothing since the keyframe before; expected a port that has"
            raise ConfigError.of_one(key, fault)
        return value_of(debugger.travel.last[key], words[1:], key)
    return value_of(component, words, f"{name}.{'.'.join(words)}")


def _sender(debugger: Debugger, path: str, port: str) -> str | None:
    """The one port whose values leave this one; None where several do."""
    try:
        return debugger.models.sender(path, port)
    except ConfigError:
        return None


def _span(value: object) -> str:
    if isinstance(value, int) and value < NEVER:
        return format_time(value)
    return "never"
