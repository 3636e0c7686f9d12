"""Choices for a run, in the command and in a program alike: its clock, its length."""

from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Literal, TypeAlias, get_args

from firmware_runtime.devs.time import LONGEST_S, NEVER, seconds
from firmware_runtime.errors import ConfigError, suggested
from firmware_runtime.executive.clocks import Clock, MonotonicClock, ScaledClock, VirtualClock

ClockName: TypeAlias = Literal["monotonic", "virtual", "scaled"]
"""Real time; virtual time, as fast as it goes; real time times a speed."""

CLOCKS: Sequence[str] = get_args(ClockName)
_OF_A_CLOCK = ("speed", "start", "now", "wait")
MOST_SPEED = 1e6
"""Of a scaled clock: what is late by an hour of real time still fits."""


def clock_faults(clock: str, speed: float | None, *, doubles: bool | Path) -> list[str]:
    """Return what contradicts itself in the choice of a robot's clock, one sentence each."""
    faults = []
    if clock == "scaled" and speed is None:
        faults.append("clock scaled: expected a speed too")
    if clock != "scaled" and speed is not None:
        faults.append(f"speed {speed:g}: expected with clock scaled only")
    if clock != "monotonic" and not doubles:
        faults.append(f"clock {clock} needs doubles: chips live in real time")
    if clock != "monotonic" and isinstance(doubles, Path):
        faults.append(f"clock {clock}: doubles that are served live in real time")
    return faults


def clock_name(clock: ClockName | Clock, speed: float | None) -> str:
    """The name of a chosen clock, `own` for one that is neither real time nor virtual.

    Raises ConfigError for a clock that is none, and a speed that is none.
    """
    is_named = isinstance(clock, str)
    if clock not in CLOCKS if is_named else not all(hasattr(clock, each) for each in _OF_A_CLOCK):
        expected = f"expected one of {', '.join(CLOCKS)}, or a clock"
        if is_named:
            expected = suggested(str(clock), CLOCKS, expected)
        raise ConfigError("clock", [f"{clock!r}: {expected}"])
    if isinstance(clock, str):
        if speed is not None:
            positive("speed", speed, MOST_SPEED)
        return clock
    if speed is not None:
        raise ConfigError("speed", [f"{speed!r}: a clock of one's own has its own speed"])
    if isinstance(clock, VirtualClock):
        return "virtual"
    return "monotonic" if isinstance(clock, MonotonicClock) and clock.speed == 1 else "own"


def clock_of(clock: ClockName | Clock, speed: float | None) -> Clock:
    """The clock chosen, once `clock_name` has found it sound."""
    if not isinstance(clock, str):
        return clock
    if clock == "virtual":
        return VirtualClock()
    return MonotonicClock() if speed is None else ScaledClock(speed)


def positive(what: str, value: float, most: float = LONGEST_S) -> float:
    """The number, if it is a positive one within reason. Raises ConfigError."""
    try:
        is_sound = 0 < value <= most and not isinstance(value, bool)
    except TypeError:  # no number at all
        is_sound = False
    if not is_sound:
        raise ConfigError(what, [f"{value!r}: expected a positive number, {most:g} at most"])
    return value


def path_of(what: str, stated: object) -> Path | None:
    """The path that was stated, if one was. Raises ConfigError for what is none."""
    if stated is None or (isinstance(stated, str | PathLike) and isinstance(fspath(stated), str)):
        return None if stated is None else Path(stated)
    raise ConfigError(what, [f"{stated!r}: expected a path"])


def demand(what: str, stated: object, expected: str, *, is_sound: bool) -> None:
    """Raise ConfigError for a choice that is not sound."""
    if not is_sound:
        raise ConfigError(what, [f"{stated!r}: expected {expected}"])


def end_after(begun: int, for_s: float | None) -> int:
    """The instant so many seconds after another one; NEVER for None. Raises ConfigError."""
    return NEVER if for_s is None else begun + seconds(positive("for_s", for_s))
