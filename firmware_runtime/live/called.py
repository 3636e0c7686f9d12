"""Functions of models that a step calls: the state that each left, and what it sent."""

from collections.abc import Callable
from functools import partial
from typing import Any, Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import raised_words
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.recording.debugger.debugger import each_function
from firmware_runtime.recording.debugger.model_state import state_of
from firmware_runtime.recording.debugger.travel import Travel
from firmware_runtime.statistics.json_values import plain

_LONGEST: Final = 120
"""Letters of a text."""
_MOST: Final = 16
"""Items of a list or fields of a record."""
_DEEPEST: Final = 4


class Called:
    """Calls of models in a step that is taken: `instrument` is the simulator's."""

    def __init__(self, travel: Travel) -> None:
        self._travel = travel
        self._events: list[dict[str, Any]] = []
        self._own = travel.player.own
        self._states: dict[str, dict[str, Any]] = {}

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """The model's functions, each of which is noted."""
        if atomic not in self._own:
            return functions
        path = below_root(atomic.path)
        return each_function(
            atomic, functions, lambda name, call: partial(self._call, atomic, path, name, call)
        )

    def _call(
        self,
        atomic: Atomic,
        path: str,
        name: str,
        function: Callable[..., None],
        *arguments: int,
    ) -> None:
        player = self._travel.player
        before, sent_before = self._states.get(path) or _state(atomic), len(player.sent)
        event = event_of(path, name, [])
        self._events.append(event)
        try:
            function(*arguments)
        except BaseException as error:
            event["raised"] = raised_words(error)
            raise
        finally:
            state = self._states[path] = _state(atomic)
            sent = [[player.ports[n], _safe(value)] for n, value in player.sent[sent_before:]]
            changed = [field for field in state if state[field] != before.get(field)]
            event |= {"state": state, "changed": changed, "sent": sent}

    def after(self) -> dict[str, Any]:
        """All of them, and what they have left."""
        simulator = self._travel.player.simulator
        atomics = [each for each in simulator.atomics if each in self._own]
        paths = {below_root(each.path): each for each in atomics}
        due = {path: simulator.due_at(each) for path, each in paths.items()}
        return {
            "events": self._events,
            "states": {path: each.phase for path, each in paths.items()},
            "sigma_s": {path: _span_s(at - simulator.now, at) for path, at in due.items()},
            "values": {port: _safe(value) for port, value in self._travel.last.items()},
        }


def event_of(model: str, function: str, sent: list[Any]) -> dict[str, Any]:
    """A call of which nothing but what was sent is known."""
    return {"model": model, "function": function, "state": {}, "changed": [], "sent": sent}


def _state(atomic: Atomic) -> dict[str, Any]:
    """What its attributes hold as plain values; of what has no words the plain ones within it."""
    found: dict[str, Any] = {}
    for name, value in state_of(atomic).items():
        if name == "sigma":
            found["sigma_s"] = _span_s(atomic.sigma, atomic.sigma)
        elif type(value).__repr__ is not object.__repr__:
            found[name] = _safe(value)
        elif isinstance(value, I2cBus | SerialPort):  # counts, which are no part of a state
            continue
        elif inner := {
            field: each
            for field, each in getattr(value, "__dict__", {}).items()
            if isinstance(each, bool | int | float | str | None)
        }:
            found[name] = _safe(inner)
    return found


def _span_s(span: int, at: int) -> float | None:
    """A span up to an instant, s; None for one that never comes."""
    return None if at >= NEVER else span / SECOND


def brief(value: object, depth: int = 0) -> Any:  # noqa: ANN401 -- whatever JSON can say
    """A value in JSON's types, cut where it is long or deep."""
    if isinstance(value, str):
        return value if len(value) <= _LONGEST else f"{value[: _LONGEST - 3]}..."
    if isinstance(value, list | dict) and value and depth >= _DEEPEST:
        return "..."
    if isinstance(value, list):
        cut = [f"... {len(value)} in all"] if len(value) > _MOST else []
        return [*(brief(each, depth + 1) for each in value[:_MOST]), *cut]
    if isinstance(value, dict):
        items = list(value.items())
        cut_fields = {"...": f"{len(items)} in all"} if len(items) > _MOST else {}
        return {key: brief(each, depth + 1) for key, each in items[:_MOST]} | cut_fields
    return value


def _safe(value: object) -> Any:  # noqa: ANN401 -- as above
    """A value of a model's, which may have no words of its own."""
    try:
        return brief(plain(value))
    except Exception as error:  # noqa: BLE001 -- of a class of the model's, whatever it is
        return f"a {type(value).__qualname__} (its text raised {type(error).__name__})"
