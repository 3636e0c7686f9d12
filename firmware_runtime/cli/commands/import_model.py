"""`firmware-runtime import FILE.ma [-o FILE.py|FOLDER]`: a model file as Python source."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_output, add_verb
from firmware_runtime.cli.chosen_model import print_warnings
from firmware_runtime.cli.written import write_text
from firmware_runtime.ecdpp.file_text import Warnings
from firmware_runtime.ecdpp.python_source import imported_source
from firmware_runtime.errors import ConfigError, Status

_ABOUT = """
The classes that the file names must be installed: an entry point of the group
firmware_runtime.ma_classes makes a package's own known. The source builds the same model, and is
yours to go on with; what is there already is not written over. With --skeletons a class that is
not known is written too: with its ports and parameters, and nothing that it does yet.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Make Python source of a model file of E-CD++."
    verb = add_verb(verbs, "import", summary, execute)
    verb.epilog = _ABOUT
    verb.add_argument("file", type=Path, metavar="FILE.ma", help="the model file")
    add_output(
        verb,
        "a module, or the folder of a package, which is made; default: the screen",
        metavar="FILE.py|FOLDER",
    )
    verb.add_argument(
        "--skeletons",
        action="store_true",
        help="write a class for each name that no installed package knows, to go on with",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Write the source, or print it."""
    output: Path | None = arguments.output
    if output is not None:
        _check_free(output)
    warnings = Warnings()
    text = imported_source(arguments.file, warnings, with_skeletons=arguments.skeletons)
    print_warnings(arguments.file, warnings.sentences())
    write_text(text, _module(output))
    return Status.OK


def _check_free(output: Path) -> None:
    """Raise ConfigError where something would be written over, or cannot be imported."""
    name = output.stem if output.suffix == ".py" else output.name
    if not name.isidentifier():
        raise ConfigError.of_one("-o", f"{output}: expected a name that Python can import")
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
