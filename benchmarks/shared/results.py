"""Where results are kept: `benchmarks/results/NAME.json`, with the conditions they hold under.

The module `bench` of a bench's folder has `SUMMARY`, `add_options(parser)` and
`execute(arguments) -> exit status`; its options are its own and those of `add_common_options`. It
prints its ratio last.
"""

import argparse
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parents[1] / "results"


def add_common_options(parser: argparse.ArgumentParser) -> None:
    """Add --json and --save."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(
        "--save",
        type=_directory,
        nargs="?",
        const=RESULTS,
        metavar="DIRECTORY",
        help="keep the JSON there too, under the bench's name; default: benchmarks/results",
    )


def _directory(text: str) -> Path:
    """A directory that is there or can be made, so that nothing is measured in vain."""
    path = Path(text)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise argparse.ArgumentTypeError(
            f"{path}: {error.strerror}; expected a directory"
        ) from error
    if not os.access(path, os.W_OK):
        raise argparse.ArgumentTypeError(f"{path}: expected a directory that may be written to")
    return path


def save(directory: Path | None, name: str, report: Mapping[str, Any]) -> None:
    """Keep a report in a directory that is there, if one was stated. Raises OSError."""
    if directory is None:
        return
    text = json.dumps(report, indent=1, allow_nan=False)
    (directory / f"{name}.json").write_text(f"{text}\n")
