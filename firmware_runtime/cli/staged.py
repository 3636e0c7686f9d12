"""`run BOARD --stage network | remote`: both ends from one command, and a line on how they fare."""

import argparse
import json
import sys

from firmware_runtime.board.ends import end_of, ends_of
from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import CONTROLLER, ROBOT
from firmware_runtime.devs.time import seconds
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.stages.stage_text import stage_line, stage_lines
from firmware_runtime.lab.stages.staged_run import (
    Staged,
    StagedResult,
    StagedRun,
    leads_to,
    run_staged,
)
from firmware_runtime.lab.stages.way import WIFI
from firmware_runtime.links.cut.impaired_path import impairment
from firmware_runtime.links.key_file import read_key
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.runs.planned_inputs import PlannedInput, inputs_after, inputs_refused
from firmware_runtime.runs.progress_line import Messages
from firmware_runtime.system.terminal import (
    OutputError,
    OwnTerminal,
    not_printed,
    print_line,
    readers_may_go,
)
from firmware_runtime.system.this_process import started_at


def run_both_ends(arguments: argparse.Namespace, board: Board) -> int:
    """Run the stage; print its one result."""
    staged = _staged(arguments, board)
    messages = Messages()
    line = _Line(messages, staged.for_s, wanted=not arguments.json)
    if not arguments.json:
        print_line(_opening(staged), sys.stdout)
    try:
        result = run_staged(staged, messages, line)
    finally:
        line.close()
    status = result.status
    try:
        with readers_may_go():
            _print(result, staged, as_json=arguments.json)
    except OutputError as error:
        not_printed(error)
        status = status or Status.NOT_PRINTED
    return status


def _staged(arguments: argparse.Namespace, board: Board) -> Staged:
    """Raises ConfigError for an input that would never arrive, and a key that is none."""
    for_s = board.doubles_run_s if arguments.duration_s is None else arguments.duration_s
    staged = Staged(
        board=board,
        named=arguments.board,
        stage=arguments.stage,
        for_s=for_s,
        how=WIFI if arguments.impair is None else impairment(arguments.impair),
        peer=arguments.peer,
        key=arguments.key,
        is_over_ros=arguments.link == "ros2",
        inputs=[str(each) for each in arguments.inputs],
        trace=arguments.trace,
        record=arguments.record,
        called_at=started_at(),
    )
    if arguments.inputs and (faults := _astray(staged, arguments.inputs)):
        raise ConfigError(board.name, faults)
    if arguments.key is not None:
        read_key(arguments.key, "--key")
    return staged


def _astray(staged: Staged, inputs: list[PlannedInput]) -> list[str]:
    """A sentence for each input that neither end would take, said before one is started."""
    faults = inputs_after(seconds(staged.for_s), inputs)
    faults += inputs_refused(Ports(staged.board.unconnected().model), inputs)
    if staged.peer is not None and not faults:
        robot = ends_of(staged.board)[ROBOT]
        faults += [
            f"--input {each}: leads to the robot end, which runs elsewhere; expected it there"
            for each in inputs
            if leads_to(staged.board, str(each), robot)
        ]
    return faults


def _opening(staged: Staged) -> str:
    ends = "a robot end elsewhere" if staged.peer is not None else "the robot end on doubles"
    return (
        f"{staged.board.name}, stage {staged.stage}: its controller and {ends}, monotonic time, "
        f"for {staged.for_s:g} s; Ctrl-C stops it"
    )


class _Line:
    """Both ends on one line of the terminal, if there is one."""

    def __init__(self, messages: Messages, for_s: float, *, wanted: bool) -> None:
        self._messages = messages
        self._for_s = for_s
        self._terminal = OwnTerminal.of(sys.stdout) if wanted else None
        messages.terminal = self._terminal

    def __call__(self, run: StagedRun) -> None:
        """Write it over the last one."""
        if self._terminal is not None:
            self._terminal.show(stage_line(run.reports, self._for_s))

    def close(self) -> None:
        """Take the line away."""
        self._messages.terminal = None
        if self._terminal is not None:
            self._terminal.close()


def _print(result: StagedResult, staged: Staged, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(result.document, allow_nan=False))
        return
    board = staged.board
    here = ends_of(board) if staged.peer is None else {CONTROLLER: ends_of(board)[CONTROLLER]}
    names = {which: end_of(board, role).name for which, role in here.items()}
    print("\n".join(["", *stage_lines(result.document, names, board.result_text)]))
