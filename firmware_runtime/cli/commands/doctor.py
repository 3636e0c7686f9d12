"""`firmware-runtime doctor [BOARD]`: what on this machine spoils a run, and what fixes it."""

import argparse
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import Status
from firmware_runtime.host.doctor.check import Machine, Result, Severity, worst
from firmware_runtime.host.doctor.registry import demands_of, examine

SCHEMA = 2
_MARKS = {
    Severity.OK: "ok",
    Severity.NOT_APPLICABLE: "-",
    Severity.NOTE: "note",
    Severity.WARNING: "WARN",
    Severity.FAILURE: "FAIL",
}
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
        print(json.dumps(_as_json(results, grade), indent=2))
    else:
        print("\n".join(_lines(results, verbose=arguments.verbose)))
    return _STATUSES.get(grade, Status.OK)


def _as_json(results: Sequence[Result], grade: Severity) -> dict[str, object]:
    return {
        "schema": SCHEMA,
        "checks": [
            {
                "id": result.check.id,
                "status": result.finding.status,
                "seen": result.finding.seen,
                "why": result.check.why,
                "fix": result.fix,
            }
            for result in results
        ],
        "worst": grade,
    }


def _lines(results: Sequence[Result], *, verbose: bool) -> Iterator[str]:
    for group, members in groupby(results, key=lambda result: result.group):
        yield group
        for result in members:
            finding = result.finding
            yield f"  {_MARKS[finding.status]:4}  {result.check.id:24} {finding.seen}"
            if verbose or finding.status.needs_attention:
                yield f"        why:  {result.check.why}"
                yield f"        fix: {result.fix}"
        yield ""
    counts = Counter(result.finding.status for result in results)
    listed = ", ".join(f"{counts[status]} {status}" for status in Severity if counts[status])
    yield f"{len(results)} checks: {listed}"
