"""`run MODEL` and `run BOARD --events FILE`: a model alone, or a quantized system, and no robot."""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from firmware_runtime.cli.arguments import refuse_idle
from firmware_runtime.cli.chosen_board import chosen_board, is_model
from firmware_runtime.cli.chosen_model import chosen_model, print_warnings
from firmware_runtime.cli.run_options import clock_of
from firmware_runtime.cli.written import check_output, check_page_file, write_text
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.time import NEVER, SECOND, seconds
from firmware_runtime.ecdpp.event_file import Event, read_events
from firmware_runtime.ecdpp.experiment import (
    AFTERMATH,
    Experiment,
    OutputLine,
    OutputRecord,
    end_of,
    write_outputs,
)
from firmware_runtime.ecdpp.file_text import Warnings
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.models.qss import System, solve
from firmware_runtime.runs.planned_inputs import plan_inputs
from firmware_runtime.statistics.closing_text import (
    closing_lines,
    did_text,
    next_text,
    punctuality,
    stopped_text,
    went_wrong,
)
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.paths import check_ending
from firmware_runtime.statistics.trace_file import tracing
from firmware_runtime.system.signals import stop_on_signals
from firmware_runtime.system.terminal import Progress, is_same_place
from firmware_runtime.view.page_file import write_page
from firmware_runtime.view.parts import Page, Series, curve

SAMPLES = 1001
"""Instants at which a quantized system is shown, unless --samples says how many."""


def run_model(arguments: argparse.Namespace) -> int:
    """Run it; outputs go to `--outputs`, else to the screen."""
    name, model = _model(arguments)
    if isinstance(model, System):
        return _solve(arguments, name, model)
    refuse_idle(arguments, name, ("plot", "samples"), ", it is no quantized system")
    if arguments.statistics is not None:
        check_ending(arguments.statistics)
    events = _events(arguments, model)
    configuration = Configuration(statistics_path=arguments.statistics, conditions={"board": name})
    root = model if events is None else Experiment(model, events)
    executive = Executive(root, clock_of(arguments), list, configuration)
    record = OutputRecord(executive.simulator)
    until = _end(arguments, events)
    plan_inputs(executive, model, name, arguments.inputs, until)
    waits = executive.clock.speed != 0
    with (
        tracing(executive.simulator, arguments.trace, at_end=waits),
        stop_on_signals(executive.request_stop),
    ):
        outcome = executive.run(until)
    _report(arguments, name, executive, outcome, record.lines)
    return Status.OK if outcome.state is RunState.ENDED else Status.MODEL_ERROR


def _model(arguments: argparse.Namespace) -> tuple[str, Component | System]:
    """The model alone and what the run is called by. Raises ConfigError."""
    if is_model(arguments.board):
        return arguments.board, chosen_model(arguments.board, arguments.assignments)
    board = chosen_board(arguments.board, arguments.assignments)
    if board.event_model is None:
        raise ConfigError(board.name, ["--events: this board's model takes no event files"])
    return board.name, board.event_model(None)


def _events(arguments: argparse.Namespace, model: Component) -> list[Event] | None:
    if arguments.events is None:
        return None
    events = read_events(arguments.events, model, warnings := Warnings())
    print_warnings(arguments.events, warnings.sentences())
    return events


def _end(arguments: argparse.Namespace, events: Sequence[Event] | None) -> int:
    """When it is over: as `--for` says, else in virtual time some seconds after the last event."""
    if arguments.duration_s is not None:
        return seconds(arguments.duration_s)
    if events is None:
        return AFTERMATH if arguments.clock == "virtual" else NEVER
    return end_of(events)


def _report(
    arguments: argparse.Namespace,
    name: str,
    executive: Executive,
    outcome: Outcome,
    lines: list[OutputLine],
) -> None:
    is_closed_in_words = not arguments.json and arguments.events is None
    if outcome.state is not RunState.ENDED and not (
        is_closed_in_words and is_same_place(sys.stdout, sys.stderr)
    ):
        print(f"firmware-runtime: {outcome.sentence}", file=sys.stderr)
    if arguments.outputs is not None:
        write_outputs(arguments.outputs, lines)
    if arguments.json:
        document = {
            "board": name,
            "clock": arguments.clock,
            "ended": {"state": outcome.state.name.lower(), "reason": outcome.reason},
            "result": {"outputs": [str(line) for line in lines]},
            "statistics": executive.statistics.as_json(),
        }
        print(json.dumps(document, allow_nan=False))
        return
    if arguments.outputs is None:
        for line in lines:
            print(line)
    if is_closed_in_words:
        if lines and arguments.outputs is None:
            print()
        print("\n".join(_closing(arguments, name, outcome, executive.statistics.figures())))


def _closing(
    arguments: argparse.Namespace, name: str, outcome: Outcome, figures: Figures
) -> list[str]:
    """The last lines of a model's run."""
    has_failed = outcome.state in {RunState.FAILED, RunState.OVERRUN}
    did = [did_text(name, figures, None, {})]
    if outcome.state is RunState.STOPPED:
        did.append(stopped_text(figures, outcome.reason))
    wrong = [f"failed: {outcome.sentence}"] if has_failed else []
    kept = arguments.statistics
    rest = [punctuality(figures), *next_text(None, None if kept is None else str(kept))]
    return closing_lines(did, [*wrong, *went_wrong(figures)], rest)


# A quantized system ------------------------------------------------------------------------------


def _solve(arguments: argparse.Namespace, name: str, system: System) -> int:
    """Solve it: its states over time, as a table and a plot."""
    idle = ("events", "inputs", "trace", "statistics", "json", "speed")
    refuse_idle(arguments, name, idle, ", it is a quantized system")
    if arguments.clock != "virtual":
        fault = f"--clock {arguments.clock}: has no effect, it is a quantized system"
        raise ConfigError.of_one(name, fault, expected="it left out")
    table: Path | None = arguments.outputs
    plot: Path | None = arguments.plot
    if table is not None:
        check_output(table, (".csv",), "--outputs")
    if plot is not None:
        check_page_file(plot, "--plot")
    until = _end(arguments, None) / SECOND
    times, values = _solved(system, until, arguments.samples or SAMPLES)
    if table is not None or plot is None:
        write_text(_table(times, values), table)
    if plot is not None:
        write_page(_page(name, times, values), plot, "--plot")
        print(plot)
    return Status.OK


def _solved(
    system: System, until: float, samples: int
) -> tuple[list[float], dict[str, list[float]]]:
    """The instants and, by output, the values then; shows how far it is at a terminal."""
    with Progress(sys.stderr, every_s=0.25) as progress:

        def shown(number: int) -> None:
            progress.show(f"{number}/{samples} instants, {number * until / samples:.3g} s")

        return solve(system, until, samples=samples, progress=shown)


def _table(times: list[float], values: dict[str, list[float]]) -> str:
    """Comma-separated, a column an output, every number so that it reads back as it was."""
    head = ",".join(["t_s", *(f'"{text}"' if "," in text else text for text in values)])
    rows = (",".join(map(repr, row)) for row in zip(times, *values.values(), strict=True))
    return "\n".join([head, *rows, ""])


def _page(title: str, times: list[float], values: dict[str, list[float]]) -> Page:
    curves = [curve(text, list(zip(times, each, strict=True))) for text, each in values.items()]
    return Page(title=title, parts=[Series("Outputs over time", "s", "value", curves)])
