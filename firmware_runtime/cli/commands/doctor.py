"""`firmware-runtime doctor [BOARD]`: what on this machine spoils a run, and what fixes it.

With `--measure`, what it is: the clocks of a board's wires, and the period that it bears.
"""

import argparse
import json
import sys
from typing import TYPE_CHECKING

import msgspec

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.host.doctor.check import Machine, Severity, worst
from firmware_runtime.host.doctor.doctor_text import doctor_document, doctor_lines
from firmware_runtime.host.doctor.registry import demands_of, examine
from firmware_runtime.system.terminal import print_line

if TYPE_CHECKING:
    from firmware_runtime.host.doctor.measuring import Bearable

_STATUSES = {Severity.WARNING: Status.DOCTOR_WARNS, Severity.FAILURE: Status.DOCTOR_FAILS}


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    about = "Check this machine for what spoils a run; nothing is changed or actuated."
    verb = add_verb(verbs, "doctor", about, execute)
    verb.epilog = (
        "Exit status, by the worst finding: 0 all well, or notes only; 7 a warning; 8 a failure; "
        "2 the board's file is not usable."
    )
    verb.add_argument(
        "board",
        nargs="?",
        metavar="BOARD",
        help="look at this board's buses, ports, addresses and priorities; else at all there are",
    )
    verb.add_argument("--json", action="store_true", help="print the findings as JSON")
    verb.add_argument(
        "--verbose", action="store_true", help="say of every check why it matters and what fixes it"
    )
    verb.add_argument(
        "--measure",
        action="store_true",
        help="instead of the checks: time BOARD's wires by reading its chips' identities, and run "
        "it on its doubles for some seconds, for the shortest period that this computer bears",
    )
    verb.add_argument(
        "--doubles",
        action="store_true",
        help="with --measure: time the wires of BOARD's doubles; nothing is kept of that",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Carry out every check, or measure, and print what was found."""
    if arguments.measure or arguments.doubles:
        return _measure(arguments)
    demands = demands_of(chosen_board(arguments.board)) if arguments.board else None
    results = examine(Machine(demands=demands))
    grade = worst([result.finding for result in results])
    if arguments.json:
        print(json.dumps(doctor_document(results, grade), indent=2))
    else:
        print("\n".join(doctor_lines(results, verbose=arguments.verbose)))
    return _STATUSES.get(grade, Status.OK)


def _measure(arguments: argparse.Namespace) -> int:
    """Time the wires, keep what was timed for `check`, and say which period is borne."""
    # of this option only: the doctor is to be quick
    from firmware_runtime.host.doctor.measuring import demand_no_run, wires_of  # noqa: PLC0415
    from firmware_runtime.runs.measured_wires import differs, keep_measured  # noqa: PLC0415

    if not arguments.board or not arguments.measure:
        raise ConfigError.of_one("doctor", "expected --measure and BOARD, whose wires are timed")
    board = chosen_board(arguments.board)
    demand_no_run()
    wires = wires_of(board, doubles=arguments.doubles)
    timed = {each.device: each.measured for each in wires if each.measured is not None}
    if timed and not arguments.doubles:
        keep_measured(board.name, timed)
    off = [each for each in wires if each.measured and differs(each.measured, each.stated_hz)]
    borne, why_not = _borne(arguments.board, [f"{each.key}={each.speed_hz}" for each in wires])
    if arguments.json:
        document = {"schema": 1, "wires": wires, "period": borne, "why_no_period": why_not}
        print(json.dumps(msgspec.to_builtins(document), indent=2))
    else:
        print("\n".join(("wires", *(f"  {each.sentence}" for each in wires))))
        for wire in off:
            print(f"  WARN  expected {wire.key} = {wire.speed_hz} in board.toml")
        print("steps: own times on doubles as measured, time on the wire computed")
        print(f"  {f'not predicted: {why_not}' if borne is None else borne.sentence}")
    is_well = not off and borne is not None and not borne.is_longer
    return Status.OK if is_well else Status.DOCTOR_WARNS


def _borne(board: str, clocks: list[str]) -> "tuple[Bearable | None, str | None]":
    """Return the period that is borne at these clocks of the wires, or why none can be said."""
    from firmware_runtime.host.doctor.measuring import bearable  # noqa: PLC0415 -- as above

    print_line(f"firmware-runtime: {board} runs on its doubles for a while", sys.stderr)
    try:
        return bearable(chosen_board(board, clocks)), None
    except ConfigError as error:
        return None, str(error)
