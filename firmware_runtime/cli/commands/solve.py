"""`firmware-runtime solve MODULE:SYSTEM --until SECONDS`: a quantized state system, as a table."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_output, add_verb
from firmware_runtime.cli.found_object import found_object
from firmware_runtime.cli.own_terminal import OwnTerminal
from firmware_runtime.cli.written import check_output, write_text
from firmware_runtime.errors import Status
from firmware_runtime.models.qss import System, solve
from firmware_runtime.models.qss.methods import METHODS
from firmware_runtime.view.line_plot import Curve, LinePlot

FORMS = (".csv", ".svg")
ABOUT = "MODULE:SYSTEM, a System of a module, or what makes one"
_PARTS = 100


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Solve a quantized state system: its states over time, as a table or a plot."
    verb = add_verb(verbs, "solve", summary, execute)
    verb.add_argument("system", metavar="MODULE:SYSTEM", help=ABOUT)
    verb.add_argument(
        "--until", type=float, required=True, metavar="SECONDS", help="solve from 0 to this instant"
    )
    verb.add_argument(
        "--samples", type=int, default=1001, metavar="N", help="instants shown (default 1001)"
    )
    verb.add_argument("--method", choices=METHODS, help="in place of the system's own")
    verb.add_argument(
        "--quantum", type=float, metavar="Q", help="of every state, in place of the system's own"
    )
    add_output(verb, "FILE.csv or FILE.svg; without it the table is printed")


def execute(arguments: argparse.Namespace) -> int:
    """Solve it, then write what came of it."""
    path: Path | None = arguments.output
    if path is not None:
        check_output(path, FORMS)
    system = _system(arguments)
    times, values = _solved(system, arguments.until, arguments.samples)
    if path is not None and path.suffix == ".svg":
        write_text(_plot(arguments.system, times, values), path)
    else:
        write_text(_table(times, values), path)
    return Status.OK


def _system(arguments: argparse.Namespace) -> System:
    """The system as the command line has it. Raises ConfigError."""
    system = found_object(arguments.system, System, ABOUT)
    given = {"method": arguments.method, "quantum": arguments.quantum}
    changes = {key: value for key, value in given.items() if value is not None}
    return replace(system, **changes) if changes else system


def _solved(
    system: System, until: float, samples: int
) -> tuple[list[float], dict[str, list[float]]]:
    """The instants and, by output, the values then; shows how far it is at a terminal."""
    terminal = OwnTerminal.of(sys.stderr)
    if terminal is None:
        return solve(system, until, samples=samples)
    step = max(samples // _PARTS, 1)

    def shown(number: int) -> None:
        if number % step == 0:
            terminal.show(f"{number}/{samples} instants, {number * until / samples:.3g} s")

    try:
        return solve(system, until, samples=samples, progress=shown)
    finally:
        terminal.close()


def _table(times: list[float], values: dict[str, list[float]]) -> str:
    """Comma-separated, a column an output, every number so that it reads back as it was."""
    head = ",".join(["t_s", *(_quoted(text) for text in values)])
    rows = (",".join(map(repr, row)) for row in zip(times, *values.values(), strict=True))
    return "\n".join([head, *rows, ""])


def _quoted(text: str) -> str:
    return f'"{text}"' if "," in text else text


def _plot(title: str, times: list[float], values: dict[str, list[float]]) -> str:
    curves = [Curve(text, list(zip(times, each, strict=True))) for text, each in values.items()]
    return LinePlot(title, "Time, s", "Value", curves).text()
