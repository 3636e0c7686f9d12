"""Task of tuning: a board's loop, and a plant from a run, a file or by hand."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_runtime.board.experiments import PidLoop, Plant
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import retunable_values
from firmware_runtime.errors import ConfigError, expected_one_of
from firmware_runtime.lab.identification.plant import KEYS, PlantParameters, Structure
from firmware_runtime.lab.identification.source import plant_of
from firmware_runtime.lab.tuning.loop import Gains
from firmware_runtime.lab.tuning.response import Body

if TYPE_CHECKING:  # it imports scipy: what is wrong with the input is said before
    from firmware_runtime.lab.identification.identified import Identified

_DRAWN: Final = 4
LEAST: Final = 1e-9
"""A mass or an inertia below it is no robot's, and gains for it would be none either."""
_UNKNOWN: Final = 0.1
"""Uncertainty of a plant whose intervals are not known: a tenth."""
Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Task:
    """Task that gains are sought for."""

    body: Body
    possible: Sequence[PlantParameters]
    """Other plants that the identification leaves possible."""
    shipped: Gains
    step: float
    noise: float
    """Standard deviation of the measured rate."""


def loop_of(board: Board) -> tuple[Plant, PidLoop]:
    """The plant and the loop that a board declares. Raises ConfigError for one without."""
    plant = plant_of(board)
    if plant.loop is None:
        fault = "its plant names no loop; expected `loop=PidLoop(...)`, the keys of its gains"
        raise ConfigError(board.name, [fault])
    known = retunable_values(board.settings, board.retunable)
    missing = [key for key in keys_of(plant.loop).values() if key not in known]
    if missing:
        fault = f"{', '.join(missing)}: no gain that may change; expected keys in `retunable`"
        raise ConfigError(board.name, [fault])
    return plant, plant.loop


def keys_of(loop: PidLoop) -> dict[str, str]:
    """Return the key of board.toml for each gain."""
    return {"kp": loop.kp, "ki": loop.ki, "kd": loop.kd}


def task_of(
    board: Board, plant: PlantParameters, intervals: Mapping[str, Interval], noise: float
) -> Task:
    """Make the task for a plant with these intervals by key."""
    declared, loop = loop_of(board)
    settings, keys = board.settings, KEYS[declared.structure]
    own_s = loop.delay_s(settings)
    known = retunable_values(settings, board.retunable)

    def late(each: PlantParameters) -> PlantParameters:
        return replace(each, delay_s=each.delay_s + own_s)

    body = Body(
        plant=late(plant),
        lag_s=declared.lag_s(settings),
        gain=loop.gain(settings),
        limit=loop.limit(settings),
        period_s=loop.period_s(settings),
    )
    ranges = [
        intervals.get(key, ((1.0 - _UNKNOWN) * value, (1.0 + _UNKNOWN) * value))
        for key, value in zip(keys, plant.values, strict=True)
    ]
    return Task(
        body=body,
        possible=[late(each) for each in _drawn(ranges)],
        shipped=Gains(**{name: float(known[key]) for name, key in keys_of(loop).items()}),
        step=loop.step(settings),
        noise=noise if declared.measures == "rate" else 0.0,
    )


def _drawn(ranges: list[Interval]) -> Iterator[PlantParameters]:
    """Plants from between the ends, by a seed of their own."""
    random = np.random.default_rng(11)
    for _ in range(_DRAWN):
        values = [float(random.uniform(low, high)) for low, high in ranges]
        values[3] = max(values[2], values[3])
        yield PlantParameters(*values)


def of_identified(identified: "Identified") -> tuple[PlantParameters, dict[str, Interval]]:
    """A plant and its intervals; an end that nothing bounds is twice the value."""
    found = identified.parameters.items()
    return identified.plant, {key: _ends(each.value, each.low, each.high) for key, each in found}


def stated_plant(
    text: str, structure: Structure, board: str
) -> tuple[PlantParameters, dict[str, Interval], float, list[str]]:
    """A plant from FILE.json of `identify`, or KEY=VALUE,...; its intervals, the noise, the doubts.

    A doubt is a sentence: the file's warnings, and that it is another board's. One stated by hand
    has none. The file, which may be a pipe, is read once. Raises ConfigError with every fault.
    """
    if "=" in text and not text.endswith(".json"):
        return _by_hand(text, structure), {}, 0.0, []
    try:
        document = json.loads(Path(text).read_bytes())
        found = document["parameters"]
        values = {key: float(found[key]["value"]) for key in KEYS[structure]}
        intervals = {
            key: _ordered(*_ends(values[key], found[key]["low"], found[key]["high"]))
            for key in KEYS[structure]
        }
        _, noise = _ordered(0.0, float(document["noise"]["deviation"]))
    except OSError as error:
        fault = f"cannot be read ({error.strerror}); expected FILE.json, or KEY=VALUE,..."
        raise ConfigError.of_one(text, fault) from error
    except (ValueError, KeyError, TypeError) as error:
        fault = f"is not what `identify -o` writes for a {structure}; expected such a file"
        raise ConfigError.of_one(text, fault) from error
    plant = _sound(text, values, structure)
    return plant, intervals, noise, _doubts(text, document, board)


def _doubts(text: str, document: Mapping[str, object], board: str) -> list[str]:
    """Return doubts about the plant of a file, a sentence each."""
    warnings, of = document.get("warnings"), document.get("board", board)
    doubts = [str(each) for each in warnings] if isinstance(warnings, list) else []
    if of != board:
        doubts.append(f"{text}: the plant of {of}; expected that of {board}")
    return doubts


def plant_of_settings(board: Board) -> tuple[PlantParameters, dict[str, Interval], float]:
    """A plant as the board's own settings state it; no intervals, no noise. Raises ConfigError."""
    declared, _ = loop_of(board)
    if not declared.stated:
        fault = f"{board.name}'s definition states no numbers of {declared.title}"
        raise ConfigError.of_one("--plant", fault, expected="FILE.json, or KEY=VALUE,...")
    given = [f"{key}={number(board.settings)!r}" for key, number in declared.stated.items()]
    return _by_hand(",".join(given), declared.structure), {}, 0.0


def _ends(value: float, low: float | None, high: float | None) -> Interval:
    """Both ends of an interval; one that nothing bounds is twice the value."""
    return float(low or 0.0), 2.0 * value if high is None else float(high)


def _ordered(low: float, high: float) -> Interval:
    """Both, finite and in order. Raises ValueError."""
    if not 0.0 <= low <= high < math.inf:
        raise ValueError((low, high))
    return low, high


def _by_hand(text: str, structure: Structure) -> PlantParameters:
    """The numbers that are stated; friction and delay that are not are none."""
    keys, faults = KEYS[structure], []
    stated: set[str] = set()
    values = dict.fromkeys(keys, 0.0)
    for each in text.split(","):
        key, _, value = each.partition("=")
        if key.strip() not in keys:
            faults.append(f"{key.strip()}: unknown key; {expected_one_of(key.strip(), keys)}")
            continue
        if key.strip() in stated:
            faults.append(f"{key.strip()}: stated twice; expected once")
        stated.add(key.strip())
        try:
            values[key.strip()] = float(value)
        except ValueError:
            faults.append(f"{key.strip()}: {value!r}: expected a number")
    if keys[0] not in stated:
        faults.append(f"{keys[0]}: missing; expected it, and any of {', '.join(keys[1:])}")
    if faults:
        raise ConfigError("--plant", faults)
    values[keys[3]] = values[keys[3]] or values[keys[2]]
    return _sound("--plant", values, structure)


def _sound(where: str, values: Mapping[str, float], structure: Structure) -> PlantParameters:
    keys = KEYS[structure]
    faults = [
        f"{key}: {value}: expected a finite number, {'above 0' if key == keys[0] else '0 or more'}"
        for key, value in values.items()
        if not math.isfinite(value) or value < 0.0 or (key == keys[0] and value == 0.0)
    ]
    if 0.0 < values[keys[0]] < LEAST:
        faults.append(f"{keys[0]}: {values[keys[0]]}: expected {LEAST:g} or more")
    if not faults and values[keys[3]] < values[keys[2]]:
        faults.append(f"{keys[3]}: {values[keys[3]]}: expected at least {keys[2]}")
    if faults:
        raise ConfigError(where, faults)
    return PlantParameters(*(values[key] for key in keys))
