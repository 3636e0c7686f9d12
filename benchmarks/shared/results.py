"""Results of benches, printed and kept in `benchmarks/results/NAME.json`, and their conditions.

The module `bench` of a bench's folder has `SUMMARY`, `add_options(parser)` for its own options and
`execute(arguments) -> exit status`; all have those of `add_common_options`. It prints its ratio
last.
"""

import argparse
import json
import os
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

from benchmarks.shared.side_by_side import PEER, PROJECT, peer_version
from firmware_runtime.cli.arguments import whole
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.system.kernel_files import THIS_MACHINE, computer_model

RESULTS = PROJECT / "benchmarks" / "results"
positive: Final = partial(whole, least=1)
"""Type of an option that is a whole number from 1 on."""


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


def finish(
    arguments: argparse.Namespace,
    name: str,
    report: Mapping[str, Any],
    lines: Callable[[Mapping[str, Any]], Iterable[str]],
) -> None:
    """Keep a report in the directory that was stated, if one was; print it, as JSON or in words.

    In words its conditions go before `lines`. Raises OSError.
    """
    if arguments.save is not None:
        kept = json.dumps(report, indent=1, allow_nan=False)
        (arguments.save / f"{name}.json").write_text(f"{kept}\n")
    if arguments.json:
        print(json.dumps(report))
    else:
        print("\n".join([_conditions_text(report["conditions"]), *lines(report)]))


def conditions() -> dict[str, Any]:
    """What a run notes of the system, its processor, its load and the peer."""
    load = round(os.getloadavg()[0], 2)
    cpu = computer_model(THIS_MACHINE) or "unknown"
    return {**system_conditions(), "cpu": cpu, "load": load, PEER: peer_version()}


def _conditions_text(found: Mapping[str, Any]) -> str:
    """The conditions in one line."""
    where = "a virtual machine" if found["virtualised"] else "no virtual machine seen"
    peer = "" if found[PEER] is None else f"; {PEER} {found[PEER]}"
    return (
        "{python} on {kernel} {machine}, {cpu}, {cpu_count} CPUs, {where}, "
        "clock {clock_source}, governor {governor}, load {load}{peer}"
    ).format(where=where, peer=peer, **found)
