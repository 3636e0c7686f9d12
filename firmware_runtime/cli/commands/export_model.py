"""`firmware-runtime export`: a coupled model in E-CD++'s format, or a recording for others."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_board, add_output, add_verb, second
from firmware_runtime.cli.chosen_model import ABOUT, chosen_model
from firmware_runtime.cli.written import write_text
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.ecdpp.atomic_class import known_classes
from firmware_runtime.ecdpp.model_writer import model_text
from firmware_runtime.errors import ConfigError, Status

_ABOUT = """
To FILE.mcap, FILE.csv or FILE.parquet a run's recording is written; RUN is its file or name, or a
board for its last run. MCAP has the topics that `ros2 BOARD` publishes, other ports, the transfers
on each line and markers, all as messages of ROS 2; a table has what left each port. To FILE.ma, or
the screen, a model is written. Reading the file gives the same model: same components, ports,
couplings and parameters. What the format cannot say is refused, and nothing is written.
"""


RUN_SUFFIXES = (".mcap", ".csv", ".parquet")
_ENDINGS = f".ma, {', '.join(RUN_SUFFIXES)}"


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Write a recorded run as MCAP, CSV or Parquet, or a model as a file of E-CD++."
    verb = add_verb(verbs, "export", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb, about=f"{ABOUT}; or a recorded RUN", metavar="MODEL|RUN")
    add_output(verb, "a model's default: the screen")
    verb.add_argument(
        "--port", metavar="PATH", help="of a table: this port alone, a column for each field"
    )
    verb.add_argument(
        "--from",
        type=second,
        metavar="T",
        dest="begin",
        help="of a run: from this second of it",
    )
    verb.add_argument("--until", type=second, metavar="T", help="of a run: to this second of it")


def execute(arguments: argparse.Namespace) -> int:
    """Write the file, once it was found to give the same model."""
    output: Path | None = arguments.output
    if output is not None and output.suffix in RUN_SUFFIXES:
        from firmware_runtime.cli.exported_run import export_run  # noqa: PLC0415 -- of runs only

        return export_run(arguments, output)
    of_runs = {"--port": arguments.port, "--from": arguments.begin, "--until": arguments.until}
    if given := [name for name, value in of_runs.items() if value is not None]:
        expected = f"expected -o FILE that ends in {', '.join(RUN_SUFFIXES)}"
        raise ConfigError.of_one("export", f"{given[0]}: has no effect on a model; {expected}")
    if output is not None and output.suffix != ".ma":
        raise ConfigError.of_one("-o", f"{output}: expected a name that ends in {_ENDINGS}")
    model = chosen_model(arguments.board, arguments.assignments)
    if not isinstance(model, Coupled):
        fault = "an atomic model; expected a coupled one"
        raise ConfigError.of_one(arguments.board, fault)
    write_text(model_text(model, known_classes()), output)
    return Status.OK
