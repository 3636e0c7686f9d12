"""`run BOARD --events FILE`: a board's model alone, fed by an E-CD++ event file."""

import argparse
import json
import sys
from collections.abc import Sequence

from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.chosen_model import chosen_model, is_model, print_warnings
from firmware_runtime.cli.clock import clock_of
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.time import seconds
from firmware_runtime.ecdpp.event_file import Event, read_events
from firmware_runtime.ecdpp.experiment import (
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
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.paths import check_ending
from firmware_runtime.statistics.trace_file import tracing
from firmware_runtime.system.signals import stop_on_signals


def run_event_file(arguments: argparse.Namespace) -> Status:
    """Run the file; outputs go to `--outputs`, else to the screen."""
    if arguments.statistics is not None:
        check_ending(arguments.statistics)
    name, model = _model(arguments)
    events = read_events(arguments.events, model, warnings := Warnings())
    print_warnings(arguments.events, warnings.sentences())
    experiment = Experiment(model, events)
    configuration = Configuration(statistics_path=arguments.statistics, conditions={"board": name})
    executive = Executive(experiment, clock_of(arguments), list, configuration)
    record = OutputRecord(executive.simulator)
    until = _end(arguments, events)
    waits = executive.clock.speed != 0
    with (
        tracing(executive.simulator, arguments.trace, at_end=waits),
        stop_on_signals(executive.request_stop),
    ):
        outcome = executive.run(until)
    _report(arguments, name, executive, outcome, record.lines)
    return Status.OK if outcome.state is RunState.ENDED else Status.MODEL_ERROR


def _model(arguments: argparse.Namespace) -> tuple[str, Component]:
    """The model alone and what the run is called by. Raises ConfigError."""
    if is_model(arguments.board):
        if arguments.model is not None:
            raise ConfigError(arguments.board, ["--model: expected a board before it"])
        return arguments.board, chosen_model(arguments.board, arguments.assignments)
    board = chosen_board(arguments.board, arguments.assignments)
    if board.event_model is None:
        raise ConfigError(board.name, ["--events: this board's model takes no event files"])
    return board.name, board.event_model(arguments.model)


def _end(arguments: argparse.Namespace, events: Sequence[Event]) -> int:
    if arguments.until is not None:
        until: int = arguments.until
        return until
    return end_of(events) if arguments.duration_s is None else seconds(arguments.duration_s)


def _report(
    arguments: argparse.Namespace,
    name: str,
    executive: Executive,
    outcome: Outcome,
    lines: list[OutputLine],
) -> None:
    if outcome.state is not RunState.ENDED:
        print(f"firmware-runtime: {outcome.reason}", file=sys.stderr)
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
    elif arguments.outputs is None:
        for line in lines:
            print(line)
