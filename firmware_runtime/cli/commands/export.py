"""`firmware-runtime export RUN|MODEL -o FILE`: a recorded run, or a model, for other programs."""

import argparse
import math
import sys
from pathlib import Path

from firmware_runtime.cli.arguments import (
    SubParsers,
    add_board,
    add_output,
    add_verb,
    path_of,
    positive,
    refuse_idle,
    second,
)
from firmware_runtime.cli.chosen_board import SUFFIX
from firmware_runtime.cli.chosen_model import ABOUT, devs_model, print_warnings
from firmware_runtime.cli.written import check_output, write_text
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MICROSECOND, NEVER, seconds
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.statistics.late_watch import Late, NothingHappened, late_activation
from firmware_runtime.statistics.paths import SUFFIX as STATISTICS
from firmware_runtime.system.atomic_file import keep_output

RUN_ENDINGS = (".mcap", ".csv", ".parquet", ".json")
_ENDINGS = f"{SUFFIX}, .py, {', '.join(RUN_ENDINGS)}"
_LAST_S = 15.0
"""How much of a run a trace shows unless that is said."""
_ABOUT = """
The ending of FILE says what is written. Of a RUN, which is a recording's file or name, a board for
its last run, or its statistics: .mcap has the topics that `ros2 BOARD` publishes, other ports, the
transfers on each line and markers, all as messages of ROS 2; .csv and .parquet are tables of what
left each port; .json is what ran when, for Perfetto: a run under way goes on, as this is taken from
its recording. Of a MODEL: .ma is E-CD++'s format, from which the same model is read, or nothing is
written; .py, or a folder that becomes a package, is Python source of a FILE.ma, yours to go on
with, whose classes must be installed (entry points of the group firmware_runtime.ma_classes).
Without -o a FILE.ma is printed as Python, another model as .ma.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Write a recorded run for other programs, or a model as E-CD++'s or Python's source."
    verb = add_verb(verbs, "export", summary, execute)
    verb.epilog = _ABOUT
    about = f"{ABOUT}; or a recorded RUN, default: whatever ran last"
    add_board(verb, required=False, about=about, metavar="MODEL|RUN")
    add_output(verb, f"a name that ends in {_ENDINGS}, or a package's folder")
    _add_of_runs(verb)
    verb.add_argument(
        "--skeletons",
        action="store_true",
        help="of a FILE.ma: write a class for each name that no installed package knows",
    )


def _add_of_runs(verb: argparse.ArgumentParser) -> None:
    run = verb.add_argument_group("of a run")
    run.add_argument(
        "--port",
        metavar="PATH",
        action="append",
        default=[],
        dest="ports",
        help="this port alone; may be repeated. A table of one port has a column for each field",
    )
    run.add_argument(
        "--from", type=second, metavar="T", dest="begin", help="from this second of the run"
    )
    run.add_argument("--until", type=second, metavar="T", help="to this second of the run")
    run.add_argument(
        "--last",
        type=positive,
        metavar="SECONDS",
        help=f"so much, up to its end; of .json {_LAST_S:g} unless this or --from is given",
    )
    run.add_argument(
        "--when-late",
        type=positive,
        metavar="US",
        help="of .json: wait for an activation later than this, then take the trace",
    )
    run.add_argument(
        "--wait", type=positive, metavar="SECONDS", help="with --when-late: give up after so long"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Write the file that its ending asks for."""
    output: Path | None = arguments.output
    ending = None if output is None else output.suffix
    if output is not None and ending in RUN_ENDINGS:
        return _export_run(arguments, output)
    refuse_idle(
        arguments, "export", ("ports", "begin", "until", "last", "when_late", "wait"), " on a model"
    )
    if arguments.board is None:
        raise ConfigError.of_one("export", "no model", expected=ABOUT)
    is_file = arguments.board.endswith(SUFFIX)
    if ending in {".py", ""} or (output is None and is_file):
        return _export_source(arguments)
    if ending not in {SUFFIX, None}:
        raise ConfigError.of_one("-o", output, expected=f"a name that ends in {_ENDINGS}")
    refuse_idle(arguments, "export", ("skeletons",), " on a model file")
    return _export_model(arguments)


# A model -----------------------------------------------------------------------------------------


def _export_model(arguments: argparse.Namespace) -> int:
    """Write a model file, once it was found to give the same model."""
    from firmware_runtime.ecdpp.atomic_class import known_classes  # noqa: PLC0415 -- of models
    from firmware_runtime.ecdpp.model_writer import model_text  # noqa: PLC0415 -- as above

    model = devs_model(arguments.board, arguments.assignments)
    if not isinstance(model, Coupled):
        raise ConfigError.of_one(arguments.board, "an atomic model", expected="a coupled one")
    write_text(model_text(model, known_classes()), arguments.output)
    return Status.OK


def _export_source(arguments: argparse.Namespace) -> int:
    """Write a model file as Python source: a module, or a package's first file."""
    from firmware_runtime.ecdpp.file_text import Warnings  # noqa: PLC0415 -- as above
    from firmware_runtime.ecdpp.python_source import imported_source  # noqa: PLC0415 -- of models

    output: Path | None = arguments.output
    if not arguments.board.endswith(SUFFIX):
        fault = f"{arguments.board}: becomes no Python source"
        raise ConfigError.of_one("export", fault, expected="a FILE.ma")
    refuse_idle(arguments, "export", ("assignments",), " on a model file")
    if output is not None:
        _check_free(output)
    file = Path(arguments.board)
    text = imported_source(file, warnings := Warnings(), with_skeletons=arguments.skeletons)
    print_warnings(file, warnings.sentences())
    write_text(text, _module(output))
    return Status.OK


def _check_free(output: Path) -> None:
    """Raise ConfigError where something would be written over, or cannot be imported."""
    name = output.stem if output.suffix == ".py" else output.name
    if not name.isidentifier():
        raise ConfigError.of_one("-o", output, expected="a name that Python can import")
    module = output if output.suffix == ".py" else output / "__init__.py"
    if module.exists():
        raise ConfigError.of_one("-o", f"{module} exists", expected="a new file")


def _module(output: Path | None) -> Path | None:
    """The file to write; the folder of a package is made. Raises ConfigError."""
    if output is None or output.suffix == ".py":
        return output
    try:
        output.mkdir(exist_ok=True)
    except OSError as error:
        fault = f"{output}: {error.strerror}; expected a folder that can be made"
        raise ConfigError.of_one("-o", fault) from error
    return output / "__init__.py"


# A run -------------------------------------------------------------------------------------------


def _export_run(arguments: argparse.Namespace, output: Path) -> int:
    """Write the file, and say what in the recording is not whole."""
    refuse_idle(arguments, "export", ("assignments", "skeletons"), " on a run")
    if output.suffix == ".json":
        refuse_idle(arguments, "export", ("ports",), " on .json")
    else:
        refuse_idle(arguments, "export", ("when_late", "wait"), f" on {output.suffix}")
    if arguments.wait is not None and arguments.when_late is None:
        raise ConfigError.of_one("export", "--wait belongs to --when-late", expected="both")
    if arguments.last is not None and arguments.begin is not None:
        raise ConfigError.of_one("export", "--last and --from", expected="one of them")
    check_output(output, [output.suffix])
    # What reads a recording is loaded for one only.
    from firmware_runtime.recording.blackbox.locations import (  # noqa: PLC0415
        find_recording,
        recording_beside_statistics,
    )

    trigger = None
    if arguments.when_late is not None:
        kept = path_of(arguments.board)
        path = recording_beside_statistics(kept)
        try:
            longest = arguments.wait or math.inf
            trigger = late_activation(kept, round(arguments.when_late * MICROSECOND), longest)
        except NothingHappened as reason:
            print(f"firmware-runtime: {reason}; no trace was written", file=sys.stderr)
            return Status.NOTHING_HAPPENED
        except KeyboardInterrupt:
            print("firmware-runtime: interrupted; no trace was written", file=sys.stderr)
            return Status.INTERRUPTED
    elif arguments.board is None or arguments.board.endswith(STATISTICS):
        path = recording_beside_statistics(path_of(arguments.board))
    else:
        path = find_recording(arguments.board)
    _write_run(arguments, path, output, trigger)
    return Status.OK


def _write_run(
    arguments: argparse.Namespace, path: Path, output: Path, trigger: Late | None
) -> None:
    """Write a stretch of a recording in the form that the file's ending asks for."""
    from firmware_runtime.recording.blackbox.listing import span_of  # noqa: PLC0415 -- of runs
    from firmware_runtime.recording.blackbox.reader import read_recording  # noqa: PLC0415
    from firmware_runtime.recording.exports import run_file  # noqa: PLC0415
    from firmware_runtime.recording.exports.observed_run import missing_in  # noqa: PLC0415
    from firmware_runtime.recording.replay.stretch import Stretch  # noqa: PLC0415

    recording = read_recording(path)
    last_s = arguments.last
    if last_s is None and arguments.begin is None and output.suffix == ".json":
        last_s = _LAST_S
    begin = arguments.begin or 0
    if last_s is not None:
        begin = max(0, span_of(recording)[1] - seconds(last_s))
    stretch = Stretch(begin, NEVER if arguments.until is None else arguments.until)
    run_file.check_stretch(recording, stretch)
    said = ""
    if output.suffix == ".json":
        content, said = run_file.perfetto_trace(recording, stretch, trigger)
        faults = missing_in(recording, begin)
    else:
        faults = recording.faults()
        content = (
            run_file.mcap_content(recording, stretch, arguments.ports)
            if output.suffix == ".mcap"
            else run_file.table_content(recording, stretch, arguments.ports, output.suffix)
        )
    keep_output(output, content)
    for fault in faults:
        print(f"firmware-runtime: not whole: {fault}", file=sys.stderr)
    print(f"{output}: {said}" if said else output)
    if trigger is not None:
        print(f"taken because of {trigger}")
