"""One row of a sweep: a run on doubles in virtual time, and what becomes of it, in flat columns.

A row is the same in this process, in any other, and on any machine: nothing in it is of the clock
or of the machine. A run that fails is a row with its error.
"""

import json
import threading
from collections.abc import Iterator, Mapping
from functools import cache
from math import isfinite
from typing import TypeAlias

from msgspec import Struct, to_builtins

from firmware_runtime.board.assignments import assigned
from firmware_runtime.board.experiments import StepExperiment
from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.board.rigs import shown_by
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, expected_one_of, text_of
from firmware_runtime.lab.experiments.curve_figures import step_response
from firmware_runtime.lab.sweeps.plan import Sweep
from firmware_runtime.recording.recorded_board import code_of, digest_of
from firmware_runtime.runs.open_board import OpenBoard, open_board
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.system.packages import version_of

Cell: TypeAlias = bool | int | float | str | None
Row: TypeAlias = dict[str, Cell]

RESULT, EXPERIMENT, STATISTICS = "result.", "experiment.", "statistics."
"""Beginnings of the names of figures."""
_ONE_AT_A_TIME = threading.Lock()
_CODE: dict[frozenset[type], str] = {}


def run_row(sweep: Sweep, row: int) -> Row:
    """Run one row; raises nothing that the run could raise."""
    found = _head(sweep, row)
    with _ONE_AT_A_TIME:  # a worker may have several threads; the interpreter has one lock
        try:
            for columns in _ran(sweep, row):
                found |= columns
        except ConfigError as error:
            found["error"] = "; ".join(error.faults)
        except FirmwareRuntimeError as error:
            found |= {"outcome": "failed", "error": text_of(error)}
        except Exception as error:  # noqa: BLE001 -- of a package's world: one row of many
            found |= {"outcome": "failed", "error": f"{type(error).__name__}: {text_of(error)}"}
    return found


def lost(sweep: Sweep, row: int, why: str) -> Row:
    """The row of a run whose process ended each time it was tried."""
    return _head(sweep, row) | {"outcome": "lost", "error": why}


class RowsOf(Struct, frozen=True):
    """The rows of a sweep, as parts of a job."""

    sweep: Sweep

    def run(self, number: int) -> Row:
        """Run one row."""
        return run_row(self.sweep, number)

    def lost(self, number: int, why: str) -> Row:
        """Return the row of a run whose process ended each time it was tried."""
        return lost(self.sweep, number, why)


def _head(sweep: Sweep, row: int) -> Row:
    """Return the columns that are known before a row runs."""
    return {
        "row": row,
        "board": sweep.board,
        "seed": sweep.seed,
        "experiment": sweep.experiment,
        "set": json.dumps(sweep.row_assignments(row)),
        **sweep.values(row),
        "outcome": "refused",
        "error": None,
        "for_s": sweep.for_s,
        "duration_s": None,
        "settings_sha256": None,
        "code_sha256": None,
        "version": release(),
    }


@cache
def release() -> str:
    """The version of this project that runs the rows."""
    return version_of("firmware-runtime") or "?"


@cache
def step_of(board: str, name: str) -> StepExperiment:
    """A board's experiment that is a step of a reference. Raises ConfigError for another."""
    experiments = board_in_force(board).experiments
    found = experiments.get(name)
    if isinstance(found, StepExperiment):
        return found
    steps = [key for key, each in experiments.items() if isinstance(each, StepExperiment)]
    fault = f"{name}: {board} has no such step; {expected_one_of(name, steps)}"
    raise ConfigError.of_one("--experiment", fault)


def settings_of_row(sweep: Sweep, row: int) -> dict[str, object]:
    """All overrides of a row by key: those of the experiment, of the sweep, and its own."""
    fixed = {} if sweep.experiment is None else step_of(sweep.board, sweep.experiment).settings
    return {**fixed, **dict(map(assigned, sweep.assignments)), **sweep.values(row)}


# The run -----------------------------------------------------------------------------------------


def _ran(sweep: Sweep, row: int) -> Iterator[Row]:
    """Yield columns bit by bit: what came before an error is kept."""
    settings = settings_of_row(sweep, row)
    experiment = None if sweep.experiment is None else step_of(sweep.board, sweep.experiment)
    with open_board(sweep.board, doubles=True, clock="virtual", set=settings) as robot:
        board = robot.board
        step = None if experiment is None else _Step(experiment, robot)
        for_s = sweep.for_s or (board.doubles_run_s if experiment is None else experiment.for_s)
        yield {"for_s": for_s, "settings_sha256": board.fingerprint}
        yield {"code_sha256": _code_sha256(robot.model), "outcome": "failed"}
        try:
            result = robot.run(for_s)
        except FirmwareRuntimeError:
            yield _statistics(robot.statistics)
            raise
        state = result.state.name.lower()
        is_sound = result.state in {RunState.ENDED, RunState.STOPPED}
        yield {"outcome": state, "duration_s": result.at_s}
        yield {"error": None if is_sound else result.reason}
        yield {} if step is None else dict(_flat(EXPERIMENT, step.figures()))
        robot.close()  # the command `run` looks at the result after the end, too
        yield dict(_flat(RESULT, robot.result))
        yield _statistics(robot.statistics)


class _Step:
    """A step of a reference in a run, and the answer that is shown."""

    def __init__(self, experiment: StepExperiment, robot: OpenBoard) -> None:
        self._experiment = experiment
        self._points: list[tuple[float, float]] = []
        shown = shown_by(robot.rig, robot.board) if robot.rig is not None else None
        if shown is None or experiment.port not in robot.model.in_ports:
            missing = f"{robot.board.name} has no port {experiment.port}, or shows nothing"
            raise ConfigError.of_one("--experiment", missing)
        robot.listen(shown, self._take)
        robot.plan(experiment.at_s, robot.model.in_ports[experiment.port], experiment.end)

    def figures(self) -> dict[str, object]:
        """Rise, overshoot and the like; times in s."""
        experiment = self._experiment
        found = step_response(self._points, experiment.begin, experiment.end)
        return {
            "rise_s": found.rise_s,
            "overshoot_percent": None if found.overshoot is None else 100.0 * found.overshoot,
            "settling_s": found.settling_s,
            "is_settled": found.settling_s is not None,
            f"final_{experiment.unit}": found.final,
        }

    def _take(self, at: int, value: float) -> None:
        since_s = at / SECOND - self._experiment.at_s
        if since_s >= 0:
            self._points.append((since_s, value))


def _flat(begin: str, values: Mapping[str, object]) -> Iterator[tuple[str, Cell]]:
    """Values by name; what is no number, text, truth or nothing is written as JSON."""
    for name, value in values.items():
        if isinstance(value, float) and not isfinite(value):
            yield f"{begin}{name}", None
            continue
        is_plain = value is None or isinstance(value, bool | int | float | str)
        yield f"{begin}{name}", value if is_plain else json.dumps(to_builtins(value))  # type: ignore[misc]


def _statistics(figures: Figures) -> Row:
    counts = {
        "run": figures.run,
        "skipped": figures.skipped,
        "coalesced": figures.coalesced,
        "overruns": figures.overruns,
        "faults": figures.faults_total,
        "deadline_misses": sum(figures.deadline_misses.values()),
    }
    return {f"{STATISTICS}{name}": count for name, count in counts.items()}


def _code_sha256(model: Coupled) -> str:
    """SHA-256 over the code of the model and its world; worked out once for each set of classes."""
    parts = list(with_all_below(model))
    kinds = frozenset(map(type, parts))
    if kinds not in _CODE:
        _CODE[kinds] = digest_of(code_of(each for each in parts if isinstance(each, Atomic)))
    return _CODE[kinds]
