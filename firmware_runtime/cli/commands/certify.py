"""`firmware-runtime certify RUN... -o FILE`: recordings replayed on several machines, on a page."""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from firmware_runtime.blackbox.found import find_recording
from firmware_runtime.certification.certificate import (
    Certificate,
    OfMachine,
    in_columns,
    merged,
    read_certificate,
)
from firmware_runtime.certification.elsewhere import certified_by
from firmware_runtime.certification.machine import this_machine
from firmware_runtime.certification.page import certificate_page, place_said, said
from firmware_runtime.certification.replaying import replayed
from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.readers_gone import print_line
from firmware_runtime.cli.written import check_output
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.chance import UNKEPT
from firmware_runtime.status import Status
from firmware_runtime.system.whole_file import keep_output

_ABOUT = """
Each recording is replayed here and by every interpreter of --with; every value that left a port
and every recorded field of state are compared, floats to the bit. A certificate that was
made on another machine is a RUN too: its machines become columns. Exit status 0: all identical;
1: something differs, or was to be replayed and was not.
"""
_SUFFIXES = (".json", ".html")


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Certify that recordings replay to the same bits on several machines."
    verb = add_verb(verbs, "certify", summary, execute)
    verb.epilog = _ABOUT
    verb.add_argument(
        "runs",
        nargs="+",
        metavar="RUN",
        help="a recording's file, a board's name for its last run, or a certificate FILE.json of "
        "another machine",
    )
    verb.add_argument(
        "--with",
        action="append",
        default=[],
        metavar="PYTHON",
        dest="interpreters",
        help="replay with this interpreter too, which has firmware-runtime installed; words of a "
        'command, such as "qemu-aarch64-static -L ROOT ROOT/usr/bin/python3"; may be repeated',
    )
    verb.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="the certificate: FILE.json for programs, FILE.html for people",
    )
    verb.add_argument("--json", action="store_true", help="print the certificate as JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Replay everything everywhere, write the certificate, print the matrix."""
    output: Path | None = arguments.output
    if output is not None:
        check_output(output, _SUFFIXES)
    elsewhere = [Path(run) for run in arguments.runs if run.endswith(".json")]
    recordings = [find_recording(run) for run in arguments.runs if not run.endswith(".json")]
    if arguments.interpreters and not recordings:
        raise ConfigError.of_one("--with", "nothing to replay; expected a recording as RUN")
    brought = [read_certificate(path) for path in elsewhere]
    made = _made(recordings, arguments.interpreters)
    certificate = merged([*made, *brought])
    _show(certificate, output, as_json=arguments.json)
    return Status.OK if certificate.is_identical else Status.MODEL_ERROR


def _made(recordings: Sequence[Path], interpreters: Sequence[str]) -> Iterator[Certificate]:
    """What this machine finds, then each interpreter."""
    if recordings:
        findings = []
        for path in recordings:
            _say(f"replaying {path} here ...")
            findings.append(replayed(path))
        yield Certificate(machines=[OfMachine(machine=this_machine(), findings=findings)])
    for interpreter in interpreters:
        _say(f"replaying {len(recordings)} recordings with {interpreter} ...")
        yield certified_by(interpreter, recordings)


def _show(certificate: Certificate, output: Path | None, *, as_json: bool) -> None:
    document = json.dumps(certificate.as_json(), indent=1, allow_nan=False) + "\n"
    if output is not None:
        is_page = output.suffix == ".html"
        keep_output(output, (certificate_page(certificate) if is_page else document).encode())
    if as_json:
        print(document, end="")
        return
    print("\n".join(_lines(certificate)))
    where = "" if output is None else f": {output}"
    print(f"{'identical' if certificate.is_identical else 'NOT IDENTICAL'}{where}")


def _lines(certificate: Certificate) -> Iterator[str]:
    """The matrix, a line for each recording and machine, and what differs."""
    machines = [each.machine.name for each in certificate.machines]
    for finding, found in in_columns(certificate):
        yield f"{finding.recording}: differing output events"
        for name, each in zip(machines, found, strict=True):
            yield f"  {said(each)}  on {name}"
            if each is not None and each.first is not None:
                yield f"    first: {place_said(each.first)}"
                if each.has_drawn:
                    yield f"    {UNKEPT}"
    yield from certificate.lacking()


def _say(what: str) -> None:
    print_line(what, sys.stderr)
