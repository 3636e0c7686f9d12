"""`firmware-runtime doctor [BOARD]`: what on this machine spoils a run, and what fixes it."""

import argparse
import json

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import Status
from firmware_runtime.host.doctor.check import Machine, Severity, worst
from firmware_runtime.host.doctor.doctor_text import doctor_document, doctor_lines
from firmware_runtime.host.doctor.registry import demands_of, examine

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


def execute(arguments: argparse.Namespace) -> int:
    """Carry out every check and print what was found."""
    demands = demands_of(chosen_board(arguments.board)) if arguments.board else None
    results = examine(Machine(demands=demands))
    grade = worst([result.finding for result in results])
    if arguments.json:
        print(json.dumps(doctor_document(results, grade), indent=2))
    else:
        print("\n".join(doctor_lines(results, verbose=arguments.verbose)))
    return _STATUSES.get(grade, Status.OK)
