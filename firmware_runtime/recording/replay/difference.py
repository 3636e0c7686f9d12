"""A difference between a run and its replay: when, which model, what of it, both values."""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from firmware_runtime.devs.time import format_time
from firmware_runtime.recording.values import numbers_in
from firmware_runtime.statistics.number_formats import NO_DATES, Dates, local_of

NOTHING: Final = "nothing"


@dataclass(frozen=True, slots=True)
class Difference:
    """`what` is `value`, `class` (of a port), `write`, `state`, `count`, `step`, `end`, `asked`."""

    at: int
    """Instant of the run, ns."""
    what: str
    model: str
    """Path below the root; of a write the line, with the device's address."""
    field: str
    """Port, attribute or counter."""
    recorded: object
    replayed: object

    @property
    def where(self) -> str:
        """Model and field."""
        return where_of(self.model, self.field)

    def as_json(self, dates: Dates = NO_DATES) -> dict[str, object]:
        """For a program, with its date in UTC if that is known.

        Floats that JSON has no word for are texts.
        """
        return {
            "t_ns": self.at,
            **dates.as_json(self.at),
            "what": self.what,
            "model": self.model,
            "field": self.field,
            "recorded": shown(numbers_in(self.recorded)),
            "replayed": shown(numbers_in(self.replayed)),
        }


def in_lines(difference: Mapping[str, Any]) -> Iterator[str]:
    """Yield lines of a difference as JSON has it: when, where, and both values."""
    date = f" ({local_of(difference['date'])})" if "date" in difference else ""
    where = where_of(difference["model"], difference["field"])
    yield f"at {format_time(difference['t_ns'])}{date}, {difference['what']} of {where}"
    yield f"  recorded: {json.dumps(difference['recorded'])}"
    yield f"  replayed: {json.dumps(difference['replayed'])}"


def where_of(model: str, field: str) -> str:
    """Model and field as one name; either may be empty."""
    return ".".join(filter(None, (model, field)))


def model_and_field(path: str, models: Collection[str]) -> tuple[str, str]:
    """A path in a state as that of a model, which may be a coupled one, and what of it."""
    head, bracket, within = path.partition("[")  # where a key begins, which may have dots
    model = head
    while model and model not in models:
        model = model.rpartition(".")[0]
    if not model:
        model = head.rpartition(".")[0]
    return model, f"{head[len(model) :].removeprefix('.')}{bracket}{within}"


def shown(value: object) -> object:
    """A value as JSON can have it, floats to the bit."""
    if isinstance(value, bytes | bytearray):
        return value.hex()
    if isinstance(value, list | tuple):
        return [shown(each) for each in value]
    if isinstance(value, dict):
        return {str(key): shown(each) for key, each in value.items()}
    if isinstance(value, float) and value - value != 0:
        return repr(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    return in_words(value)


def in_words(value: object) -> str:
    """Return a value's own words; its class where its own `__repr__` raises."""
    try:
        return repr(value)
    except Exception:  # noqa: BLE001 -- of a class of the model's
        return f"a {type(value).__qualname__}"
