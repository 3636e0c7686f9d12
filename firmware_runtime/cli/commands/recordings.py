"""`firmware-runtime recordings [BOARD]`: list them, keep one as a file, save what is whole."""

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_output, add_verb
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.recording.blackbox.chunk_file import used_of
from firmware_runtime.recording.blackbox.file_content import whole_content_of
from firmware_runtime.recording.blackbox.layout import PREFIX_SIZE, is_of_another_format
from firmware_runtime.recording.blackbox.listing import KEPT_RUN, LAST, Listed, listed, span_of
from firmware_runtime.recording.blackbox.locations import (
    find_recording,
    kept_recordings,
    last_recordings,
)
from firmware_runtime.recording.blackbox.reader import another_format, read_recording
from firmware_runtime.recording.blackbox.salvage import save
from firmware_runtime.statistics.number_formats import local
from firmware_runtime.system.atomic_file import keep_output

KEEP, RECOVER = "keep", "recover"

_ABOUT = """
`recordings` lists those of the last runs, and what `record` has kept of earlier ones; the name in
front is what replay and export take. `recordings keep RUN` writes one into a file that can be sent,
without the part of its memory that is not in use. `recordings recover FILE -o FILE` saves what is
whole of one that was cut or damaged, and says what is lost.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "List the recordings of runs; keep one as a file, or save what is whole of one."
    verb = add_verb(verbs, "recordings", summary, execute)
    verb.epilog = _ABOUT
    verb.usage = (
        "firmware-runtime recordings [BOARD] [--in FOLDER] [--json] | keep RUN [-o FILE] "
        "| recover FILE -o FILE"
    )
    verb.add_argument(
        "board", metavar="BOARD", nargs="?", help="of this board only; or keep, recover"
    )
    verb.add_argument(
        "run", metavar="RUN", nargs="?", help="of keep and recover: a recording's file or name"
    )
    verb.add_argument(
        "--in", type=Path, metavar="FOLDER", dest="folder", help="those in this folder only"
    )
    verb.add_argument("--json", action="store_true", help="print the list as JSON")
    add_output(verb, "of keep and recover: the file to write")


def execute(arguments: argparse.Namespace) -> int:
    """List, keep or recover."""
    if arguments.board in {KEEP, RECOVER}:
        _refuse(arguments, {"--in": arguments.folder, "--json": arguments.json or None})
        if arguments.run is None:
            expected = "expected a recording's file, or a board or a name that has one"
            raise ConfigError.of_one(f"recordings {arguments.board}", expected)
        act = _keep if arguments.board == KEEP else _recover
        return act(arguments.run, arguments.output)
    _refuse(arguments, {"-o": arguments.output, str(arguments.run): arguments.run})
    rows = _once([listed(path) for path in _paths(arguments.board, arguments.folder)])
    if arguments.json:
        print(json.dumps([each.as_json() for each in rows], allow_nan=False))
    else:
        of = "" if arguments.board is None else f" of {arguments.board}"
        print("\n".join(_table(rows)) if rows else f"no recordings{of}")
    return Status.OK


def _refuse(arguments: argparse.Namespace, given: dict[str, object]) -> None:
    """Raise ConfigError for what has no effect here."""
    for name, value in given.items():
        if value is not None:
            does = arguments.board if arguments.board in {KEEP, RECOVER} else "the list"
            fault = f"{name}: has no effect on {does}; expected `keep RUN` or `recover FILE`"
            if does != "the list":
                fault = f"{name}: has no effect on {does}; expected RUN, and -o FILE"
            raise ConfigError.of_one("recordings", fault)


def _paths(board: str | None, folder: Path | None) -> list[Path]:
    if folder is None:
        return [*last_recordings(board), *kept_recordings(board)]
    if not folder.is_dir():
        raise ConfigError.of_one("--in", f"{folder}: no folder", expected="one with recordings")
    return sorted(folder.glob(f"{board or ''}*.recording"))


def _once(rows: Sequence[Listed]) -> list[Listed]:
    """Without the copies of runs that are still in memory."""
    last = {each.run for each in rows if each.why == LAST}
    return [each for each in rows if each.why != KEPT_RUN or each.run not in last]


def _table(rows: Sequence[Listed]) -> Iterator[str]:
    width = max(len(each.name) for each in rows)
    spans = f"{'FROM S':>9}  {'TO S':>9}  {'MIB':>6}"
    yield f"{'NAME':{width}}  {spans}  {'END':8}  {'WHY':8}  {'BEGAN':28}  WHOLE"
    for each in rows:
        if each.fault is not None:
            yield f"{each.name:{width}}  {each.fault}"
            continue
        whole = "yes" if not each.faults else f"no: {'; '.join(each.faults)}"
        span = f"{each.begin / SECOND:9.3f}  {each.until / SECOND:9.3f}"
        began = "-" if each.began is None else local(each.began)
        size = f"{each.size / (1 << 20):6.1f}"
        end = f"{each.end:8}  {each.why:8}  {began:28}"
        yield f"{each.name:{width}}  {span}  {size}  {end}  {whole}"


def _keep(run: str, output: Path | None) -> int:
    """Write what of a recording is used, in order."""
    recording = read_recording(find_recording(run))
    path = Path(f"{recording.header.run}.recording") if output is None else output
    content = used_of(recording)
    keep_output(path, content)
    begin, until = span_of(recording)
    print(f"{path}: {begin / SECOND:.3f} s to {until / SECOND:.3f} s, {_size(content)}")
    for fault in recording.faults():
        print(f"  not whole: {fault}")
    return Status.OK


def _recover(run: str, output: Path | None) -> int:
    """Write what is whole, and say what is not."""
    if output is None:
        raise ConfigError.of_one("recordings recover", "expected -o FILE, to write what is saved")
    path = find_recording(run)
    content = whole_content_of(path)
    if is_of_another_format(content[:PREFIX_SIZE]):
        raise another_format(path, content)
    saved = save(path, content)
    keep_output(output, saved.content)
    begin, until = (each / SECOND for each in saved.span)
    lost = "; ".join(saved.lost) or "nothing"
    print(f"{output}: {saved.sections} sections, {begin:.3f} s to {until:.3f} s; lost: {lost}")
    return Status.OK


def _size(content: bytes) -> str:
    return f"{len(content) / (1 << 20):.1f} MiB"
