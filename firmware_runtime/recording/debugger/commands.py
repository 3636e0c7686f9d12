"""The debugger's commands: one line each, with the short names of pdb and gdb."""

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER, SECOND, format_time
from firmware_runtime.errors import ConfigError, did_you_mean
from firmware_runtime.recording.debugger.debugger import Breakpoint, Debugger, Ended, Event, Goal
from firmware_runtime.recording.debugger.model_state import FUNCTIONS, state_of, value_of
from firmware_runtime.recording.debugger.predicate import Predicate
from firmware_runtime.recording.replay.difference import shown
from firmware_runtime.recording.values import UnknownValue, plain
from firmware_runtime.system.whole_numbers import whole_number

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


def _value(debugger: Debugger, name: str, words: list[str]) -> object:
    component = debugger.models.component(name)
    if words[0] in component.out_ports:
        key = debugger.models.sender(name, words[0])
        if key not in debugger.travel.last:
            fault = "has sent nothing so far, as it is recorded; expected a port that has"
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


Say = Callable[[list[str], dict[str, object]], None]
"""Gets an answer, as lines and as JSON."""
_MOST: Final = 1_000_000


class Command(NamedTuple):
    """A command, what it takes and what it does; `moves` if it sets a goal."""

    names: tuple[str, ...]
    takes: str
    about: str
    moves: bool


COMMANDS: Final = (
    Command(("where", "w"), "", "the instant, the event, and the first difference so far", False),
    Command(("models", "m"), "[PART]", "paths of models, of those with PART in them", False),
    Command(("print", "p"), "PATH", "state and ports of a model; one port or attribute", False),
    Command(("ports",), "MODEL", "its ports, with the last value of each that sends", False),
    Command(("next", "n"), "[COUNT]", "to after the next call of a model's function", True),
    Command(("step", "s"), "[COUNT]", "to the end of the instant, or of the next", True),
    Command(("back", "rn"), "[COUNT]", "to before the last event", True),
    Command(("rstep", "rs"), "[COUNT]", "to before the last instant", True),
    Command(("goto", "g"), "T", "to where second T of the run has happened", True),
    Command(("until", "u"), "PREDICATE", "on to where it begins to hold", True),
    Command(("break", "b"), "[PREDICATE | MODEL.FUNCTION]", "stop there; alone: list them", False),
    Command(("delete", "d"), "[NUMBER]", "a breakpoint, or all", False),
    Command(("continue", "c"), "", "on to a breakpoint, or the end of the recording", True),
    Command(("pdb",), "MODEL.FUNCTION", "on to its next call, and pdb within it", True),
    Command(("help", "h", "?"), "", "this", False),
    Command(("quit", "q", "exit"), "", "leave", True),
)
_NAMED: Final = {name: each for each in COMMANDS for name in each.names}


class Commands:
    """Carries out lines; answers go to `say`."""

    def __init__(self, debugger: Debugger, say: Say) -> None:
        self.debugger = debugger
        self.reason = ""
        """Reason of the stop."""
        self._say = say
        self._number = 0

    def stopped(self, reason: str) -> None:
        """Say where it is."""
        self.reason = reason
        self._where("")

    def do(self, line: str) -> bool:
        """Carry out a line; return whether it goes somewhere. Raises ConfigError, Ended."""
        word, _, rest = line.strip().partition(" ")
        command = _NAMED.get(word)
        if command is None:
            hint = did_you_mean(word, list(_NAMED)) or "; `help` lists them"
            raise ConfigError.of_one(word, f"no such command{hint}")
        getattr(self, f"_{command.names[0]}")(rest.strip())
        return command.moves

    def completions(self, line: str) -> list[str]:
        """Return what the last word of a line may be."""
        before, _, last = line.rpartition(" ")
        if not before.strip():
            return [each.names[0] for each in COMMANDS if each.names[0].startswith(last)]
        models = self.debugger.models.by_path
        return [each for path in models for each in self._words(path) if each.startswith(last)]

    def _words(self, path: str) -> Iterator[str]:
        yield path
        component = self.debugger.models.by_path[path]
        yield from (f"{path}.{port}" for port in component.out_ports)
        if not isinstance(component, Coupled):
            yield from (f"{path}.{each}" for each in FUNCTIONS)

    # What they do ---------------------------------------------------------------------------------

    def _where(self, _: str) -> None:
        lines = list(where_text(self.debugger, self.reason))
        self._say(lines, where_json(self.debugger, self.reason))

    def _models(self, part: str) -> None:
        named = self.debugger.models.by_path.items()
        found = {path: type(each).__name__ for path, each in named if part in path}
        self._say([f"{path} ({kind})" for path, kind in found.items()], {"models": found})

    def _print(self, path: str) -> None:
        _required(path, "a model, a port or an attribute")
        self._say(list(printed_text(self.debugger, path)), printed_json(self.debugger, path))

    def _ports(self, path: str) -> None:
        _required(path, "a model")
        lines = list(ports_text(self.debugger, path))
        self._say(lines, {"path": path, "ports": ports_of(self.debugger, path)})

    def _next(self, count: str) -> None:
        self.debugger.stops.goal = Goal(events=_count(count))

    def _step(self, count: str) -> None:
        self.debugger.stops.goal = Goal(instants=_count(count))

    def _back(self, count: str) -> None:
        self.debugger.go_back_events(_count(count))

    def _rstep(self, count: str) -> None:
        self.debugger.go_back_instants(_count(count))

    def _goto(self, second: str) -> None:
        self.debugger.go_to_instant(_second(second))

    def _until(self, text: str) -> None:
        _required(text, "a predicate")
        self.debugger.go_until(Predicate(text, self.debugger.models))

    def _continue(self, _: str) -> None:
        self.debugger.go_until(None)

    def _break(self, text: str) -> None:
        if text:
            self.debugger.stops.breakpoints.append(self._breakpoint(text, attaches=False))
        found = {each.number: each.text for each in self.debugger.stops.breakpoints}
        lines = [f"{number}: {each}" for number, each in found.items()] or ["no breakpoints"]
        self._say(lines, {"breakpoints": {str(each): found[each] for each in found}})

    def _pdb(self, text: str) -> None:
        _required(text, "a function of a model, such as controller.pid.internal")
        self.debugger.models.function(text)
        self.debugger.stops.breakpoints.append(self._breakpoint(text, attaches=True))
        self.debugger.go_until(None)

    def _delete(self, number: str) -> None:
        points = self.debugger.stops.breakpoints
        if number and number not in {str(each.number) for each in points}:
            raise ConfigError.of_one(number, "no such breakpoint; `break` lists them")
        points[:] = [each for each in points if number and str(each.number) != number]
        self._break("")

    def _help(self, _: str) -> None:
        lines = [
            f"{', '.join(each.names)} {each.takes}".strip().ljust(40) + f" {each.about}"
            for each in COMMANDS
        ]
        self._say(lines, {"commands": [each.names[0] for each in COMMANDS]})

    def _quit(self, _: str) -> None:
        raise Ended

    def _breakpoint(self, text: str, *, attaches: bool) -> Breakpoint:
        models = self.debugger.models
        name, words = text.rpartition(".")[0], text.rpartition(".")[2]
        number = self._number + 1
        if words in FUNCTIONS and name in models.by_path:
            models.function(text)
            found = Breakpoint(number, text, function=Event(name, words), attaches=attaches)
        else:
            found = Breakpoint(number, text, predicate=Predicate(text, models))
        self._number = number
        return found


def _required(text: str, what: str) -> None:
    if not text:
        raise ConfigError.of_one("command", "nothing given", expected=what)


def _count(text: str) -> int:
    number = whole_number(text or "1", _MOST)
    if number:
        return number
    raise ConfigError.of_one(text, f"expected how often, 1 to {_MOST}")


def _second(text: str) -> int:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < 1e9:
        raise ConfigError.of_one(text or "goto", "expected a second of the run, such as 9.06")
    return round(value * SECOND)
