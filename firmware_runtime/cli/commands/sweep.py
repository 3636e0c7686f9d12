"""`firmware-runtime sweep BOARD`, `sweep show FILE`, `sweep rerun FILE ROW`: many runs, a table."""

import argparse
import json
import sys
from contextlib import closing
from pathlib import Path

import msgspec

from firmware_runtime.cli.arguments import (
    SubParsers,
    add_board,
    add_duration,
    add_output,
    add_verb,
)
from firmware_runtime.cli.many_runs import RowProgress, add_how, interruptible
from firmware_runtime.cli.written import write_text
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.sweeps.distributions import FORMS
from firmware_runtime.lab.sweeps.plan import SAMPLINGS, Sweep
from firmware_runtime.lab.sweeps.row import run_row
from firmware_runtime.lab.sweeps.summary import summary, text_of
from firmware_runtime.lab.sweeps.sweep_page import sweep_page
from firmware_runtime.lab.sweeps.sweep_table import Table, read_table, sweep_of
from firmware_runtime.lab.sweeps.sweeping import carry_out, faults_of
from firmware_runtime.system.terminal import print_line
from firmware_runtime.view.page import page_of

_SUMMARY = "Run a board many times in virtual time, each with other values; or show the table."
_ABOUT = f"""
Distributions: {"; ".join(FORMS.values())}. Grids (range, linspace) are gone through in all
combinations, the key named last the fastest; the others are drawn again in every row. --runs is the
number of rows: by default each point of the grid once; with more the grid begins again, with fewer
it is left early. `sweep show FILE [--json | -o PAGE.html]` sums a table up, `sweep rerun FILE ROW`
runs one of its rows again and says whether it is the same. A run that fails is a row. Exit status
0: done, 1: a row that was run again is another.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "sweep", _SUMMARY, execute)
    verb.epilog = _ABOUT
    add_board(verb, about="a board's name or file; or `show`, or `rerun`")
    verb.add_argument("file", metavar="FILE", nargs="?", type=Path, help="of show and rerun")
    verb.add_argument("row", metavar="ROW", nargs="?", type=int, help="of rerun")
    verb.add_argument("--json", action="store_true", help="print one JSON object")
    add_output(verb, "FILE.parquet or FILE.csv; show: a page")
    _add_values(verb)
    add_how(verb, "sweep")


def _add_values(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="KEY=DISTRIBUTION",
        help="such as 'world.mass_kg=uniform(2, 4)'; may be repeated",
    )
    verb.add_argument("--runs", type=int, metavar="N", help="how many rows; default: the grid's")
    verb.add_argument(
        "--seed", type=int, default=0, metavar="S", help="chooses what is drawn; default 0"
    )
    verb.add_argument(
        "--sampling",
        choices=SAMPLINGS,
        default="random",
        help="lhs: Latin hypercube, each of N parts of every key once",
    )
    add_duration(
        verb,
        "how long each run takes; default: what the board or the experiment says",
        dest="for_s",
    )
    verb.add_argument(
        "--experiment", metavar="NAME", help="a step of the board, such as step: its figures"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run, show or run again."""
    if arguments.board == "show":
        return _show(arguments)
    if arguments.board == "rerun":
        return _rerun(arguments)
    return _sweep(arguments)


def _sweep(arguments: argparse.Namespace) -> int:
    faults = [] if arguments.file is None else [f"{arguments.file}: expected options only"]
    if arguments.output is None:
        faults.append("-o: no file for the table; expected -o FILE.parquet or FILE.csv")
    vary: dict[str, str] = {}
    for word in arguments.vary:
        key, separator, words = word.partition("=")
        if not (key.strip() and separator):
            faults.append(f"--vary {word}: expected KEY=DISTRIBUTION")
        elif key.strip() in vary:
            faults.append(f"--vary {key.strip()}: stated twice; expected once")
        else:
            vary[key.strip()] = words.strip()
    sweep = Sweep(
        board=arguments.board,
        vary=vary,
        assignments=arguments.assignments,
        runs=arguments.runs,
        seed=arguments.seed,
        for_s=arguments.for_s,
        experiment=arguments.experiment,
        sampling=arguments.sampling,
    )
    if faults:
        raise ConfigError("sweep", faults + (faults_of(sweep) if vary else []))
    with interruptible(arguments.output), closing(RowProgress()) as progress:
        table = carry_out(
            sweep,
            arguments.output,
            workers=arguments.workers,
            scheduler=arguments.scheduler,
            resume=arguments.resume,
            progress=progress,
        )
    return _told(sweep, table, arguments)


def _told(sweep: Sweep, table: Table, arguments: argparse.Namespace) -> int:
    found = summary(table, str(arguments.output))
    if sweep.has_grid_left_over:
        left = f"{sweep.size} runs do not go through the grid of {sweep.grid_size} a whole number"
        print_line(f"firmware-runtime: {left} of times", sys.stderr)
    if arguments.json:
        told = {"file": str(arguments.output), "rows": found.rows, "outcomes": found.outcomes}
        print(json.dumps(told))
        return Status.OK
    outcomes = ", ".join(f"{count} {name}" for name, count in found.outcomes.items())
    print(f"{arguments.output}: {found.rows} runs: {outcomes}")
    return Status.OK


def _show(arguments: argparse.Namespace) -> int:
    _demand(arguments, "show FILE", has_row=False)
    if arguments.output is not None and arguments.output.suffix != ".html":
        fault = f"-o: {arguments.output}; expected a name that ends in .html"
        raise ConfigError("sweep show", [fault])
    table = read_table(arguments.file)
    found = summary(table, str(arguments.file))
    if arguments.output is not None:
        write_text(page_of(sweep_page(table, found)), arguments.output)
    elif arguments.json:
        print(msgspec.json.encode(found).decode())
    else:
        for line in text_of(found):
            print(line)
    return Status.OK


def _rerun(arguments: argparse.Namespace) -> int:
    _demand(arguments, "rerun FILE ROW", has_row=True)
    table = read_table(arguments.file)
    before = table.row(arguments.row)
    now = run_row(sweep_of(before), 0)
    others = {
        name: (before.get(name), now.get(name))
        for name in table.columns
        if name not in {"row", "seed", *table.varied} and before.get(name) != now.get(name)
    }
    if arguments.json:
        print(json.dumps({"row": {**before, **now, "row": arguments.row}, "is_same": not others}))
    else:
        _print_row(now, arguments.row)
        for name, (then, found) in others.items():
            print(f"{name} is another: {then} in the table, {found} now")
        if not others:
            print("the same as in the table")
    return Status.MODEL_ERROR if others else Status.OK


def _print_row(row: dict[str, bool | int | float | str | None], number: int) -> None:
    error = row["error"]
    print(f"row {number}: {row['outcome']}{'' if error is None else f': {error}'}")
    for name, value in row.items():
        if "." in name:
            print(f"{name} {value}")


def _demand(arguments: argparse.Namespace, form: str, *, has_row: bool) -> None:
    """Refuse what does not belong to this form of the verb."""
    faults = [] if arguments.file is not None else [f"no FILE; expected sweep {form}"]
    if has_row != (arguments.row is not None):
        faults.append(f"{'no ROW' if has_row else arguments.row}; expected sweep {form}")
    if arguments.vary or arguments.assignments:
        faults.append(f"--vary and --set belong to a sweep of a board; expected sweep {form}")
    if faults:
        raise ConfigError("sweep", faults)
