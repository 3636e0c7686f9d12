"""Levels of `/diagnostics`, by the numbers of `stats --json` and by these rules.

    OK      nothing went wrong in the last 10 s
    WARN    something did: an overrun, a fault, a missed deadline, an error or a retry on a bus, an
            input dropped; or a model does not keep the period it states, a bus is busy for over
            80 % of the time, or the run has given up its priority
    ERROR   ten times or more in the last 10 s, or logical time has stood still for over 1 s
    STALE   there is no run: it has ended, has died, or left no statistics

Without ROS: levels are its numbers, everything else is texts.
"""

import json
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any, Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import BeingWrittenError, FirmwareRuntimeError
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

LATELY: Final = 10 * SECOND
OFTEN: Final = 10
STANDSTILL: Final = SECOND
BUSY: Final = 0.8
_APART: Final = ("models", "bus", "serial", "faults", "deadlines", "worst", "conditions")
"""What is not in the status of the run itself: it has its own, or is too long."""


class Level(IntEnum):
    """Level of a diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Status:
    """One diagnostic status."""

    name: str
    level: Level
    message: str
    values: dict[str, str] = field(default_factory=dict)


class Lately:
    """Counters, looked at again and again; remembers those of 10 s ago."""

    def __init__(self) -> None:
        self._before: deque[tuple[int, dict[str, int]]] = deque()

    def of(self, counts: Mapping[str, int], now: int) -> dict[str, int]:
        """Return by how much each has grown in the last 10 s, or since the first look."""
        before = self._before
        if before and any(counts.get(name, 0) < count for name, count in before[-1][1].items()):
            before.clear()  # another run has begun
        before.append((now, dict(counts)))
        while len(before) > 1 and before[1][0] <= now - LATELY:
            before.popleft()
        first = before[0][1]
        return {name: count - first.get(name, 0) for name, count in counts.items()}


class Judge:
    """Reads a run's statistics again and again; remembers what had gone wrong 10 s ago."""

    def __init__(self, board: str, path: Path) -> None:
        self._board = board
        self._path = path
        self._lately = Lately()

    def judge(self, now: int) -> list[Status]:
        """Return all statuses, that of the run first; `now` is any clock in ns."""
        try:
            statistics = read_statistics(self._path)
            figures = statistics.figures()
        except BeingWrittenError as error:
            return [Status(f"{self._board}: run", Level.ERROR, str(error))]
        except FirmwareRuntimeError as error:
            self._lately = Lately()
            return [Status(f"{self._board}: run", Level.STALE, f"no run: {error}")]
        if statistics.state is not RunState.RUNNING or not statistics.writer_alive:
            self._lately = Lately()
            return [self._over(figures), *self._left(figures)]
        lately = self._lately.of(wrong_counts(figures), now)
        statuses = [self._part(name, figures, lately) for name in _parts(figures)]
        return [self._run(statistics, figures, lately, statuses), *statuses]

    def _over(self, figures: Figures) -> Status:
        run = figures.conditions.run
        message = f"the run is over: {run.state}" + (f", {run.reason}" if run.reason else "")
        return Status(f"{self._board}: run", Level.STALE, message, _run_values(figures))

    def _left(self, figures: Figures) -> list[Status]:
        """The parts of a run that is over, with their last numbers."""
        return [
            Status(
                self._name(name), Level.STALE, "of a run that is over", _values(name, figures)[0]
            )
            for name in _parts(figures)
        ]

    def _run(
        self,
        statistics: Statistics,
        figures: Figures,
        lately: Mapping[str, int],
        parts: list[Status],
    ) -> Status:
        level, why = _by_count(lately["run"], "inputs dropped")
        age = statistics.heartbeat_age_ns
        reasons = [why] if why else []
        if age is not None and age > STANDSTILL:
            level = Level.ERROR
            reasons.insert(0, f"logical time stands still for {age / SECOND:.1f} s")
        if figures.conditions.run.overloaded_s is not None:
            level = max(level, Level.WARN)
            reasons.append("it has given up its priority")
        worst = max(parts, key=lambda part: part.level, default=None)
        if worst is not None and worst.level > level:
            level = worst.level
            reasons.append(f"{worst.name.removeprefix(f'{self._board}: ')}: {worst.message}")
        armed = "armed" if figures.conditions.run.armed else "disarmed"
        return Status(
            f"{self._board}: run", level, "; ".join([*reasons, armed]), _run_values(figures)
        )

    def _part(self, name: str, figures: Figures, lately: Mapping[str, int]) -> Status:
        values, what, reasons = _values(name, figures)
        level, why = _by_count(lately[name], what)
        if reasons:
            level = max(level, Level.WARN)
        message = "; ".join(filter(None, [why, *reasons])) or "nothing went wrong lately"
        return Status(self._name(name), level, message, values)

    def _name(self, part: str) -> str:
        return f"{self._board}: {part.removeprefix('model ')}"


def wrong_counts(figures: Figures) -> dict[str, int]:
    """Return how often something has gone wrong in each part, since the start of the run."""
    counts = {"run": figures.conditions.run.inputs_dropped}
    for path, model in figures.models.items():
        faults = sum(each.count for each in figures.faults.get(path, {}).values())
        counts[f"model {path}"] = model.overruns + faults
    for path in figures.faults.keys() - figures.models.keys():
        counts[f"model {path}"] = sum(each.count for each in figures.faults[path].values())
    for name, bus in figures.bus.items():
        counts[f"bus {name}"] = bus.errors + bus.retries
    for name, port in (figures.serial or {}).items():
        counts[f"serial {name}"] = port.errors
    for name, misses in figures.deadline_misses.items():
        counts[f"deadline {name}"] = misses
    return counts


def flat(value: Any, name: str = "") -> Iterator[tuple[str, str]]:  # noqa: ANN401 -- JSON
    """Keys and texts of a piece of JSON, such as `lateness_us.p99`; what is null is left out."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield from flat(each, f"{name}.{key}" if name else str(key))
    elif value is not None:
        yield name, value if isinstance(value, str) else json.dumps(value)


def _parts(figures: Figures) -> list[str]:
    return [name for name in wrong_counts(figures) if name != "run"]


def _values(name: str, figures: Figures) -> tuple[dict[str, str], str, list[str]]:
    """The values of a part, what went wrong with it where something did, and what else is wrong."""
    kind, _, path = name.partition(" ")
    found = figures.as_json()
    if kind == "bus":
        bus = figures.bus[path]
        is_busy = bus.utilisation is not None and bus.utilisation > BUSY
        return (
            dict(flat(found["bus"][path])),
            "errors and retries",
            [f"busy for {bus.utilisation:.0%} of the time"] if is_busy else [],
        )
    if kind == "serial":
        return dict(flat(found["serial"][path])), "errors", []
    if kind == "deadline":
        return dict(flat(found["deadlines"][path])), "missed", []
    model = figures.models.get(path)
    faults = found["faults"].get(path, {})
    values = dict(flat({**found["models"].get(path, {}), "faults": faults}))
    reasons = [] if model is None or model.keeps_period else ["does not keep its period"]
    kinds = figures.faults.get(path, {}).values()
    last = max(kinds, key=lambda each: each.last_s or 0, default=None)
    what = "overruns and faults" + ("" if last is None else f", the last fault: {last.last}")
    return values, what, reasons


def _by_count(count: int, what: str) -> tuple[Level, str]:
    if count <= 0:
        return Level.OK, ""
    level = Level.ERROR if count >= OFTEN else Level.WARN
    return level, f"{count} lately: {what}"


def _run_values(figures: Figures) -> dict[str, str]:
    found = figures.as_json()
    own = {key: each for key, each in found.items() if key not in _APART}
    return dict(flat({**own, "conditions": {"run": found["conditions"]["run"]}}))


_WRONG: Final = ("refused", "dropped", "failed")


class TopicJudge:
    """Judges the counts of one node's topics again and again; remembers those of 10 s ago."""

    def __init__(self, board: str) -> None:
        self._name = f"{board}: topics"
        self._lately = Lately()

    def judge(self, counts: Mapping[str, int], now: int) -> list[Status]:
        """The status; none before the first message. `now` is any clock in ns."""
        if not counts:
            return []
        lately = self._lately.of({name: counts.get(name, 0) for name in _WRONG}, now)
        wrong = [f"{count} {name}" for name, count in lately.items() if count > 0]
        level = Level.WARN if wrong else Level.OK
        message = f"in the last 10 s: {', '.join(wrong)}" if wrong else "every message is carried"
        return [Status(self._name, level, message, {key: str(n) for key, n in counts.items()})]
