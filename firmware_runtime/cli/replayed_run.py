"""`firmware-runtime replay RUN` for a recording of the black box: the whole run, run again."""

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from time import monotonic_ns, sleep

from firmware_runtime.cli.written import check_test_file
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.section import Section
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.replay.stretch import Stretch
from firmware_runtime.recording.replay.verdict import replay, verdict_document, verdict_lines
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.system.terminal import Progress


def replay_run(arguments: argparse.Namespace, path: Path) -> int:
    """Run it again, and print whether it was the same."""
    recording = read_recording(path)
    header = recording.header
    board = board_of(header)
    stretch = Stretch(arguments.begin, arguments.until)
    begun = monotonic_ns()
    with Progress(sys.stderr, wanted=not arguments.json, every_s=0.25) as shown:
        verdict = replay(recording, board, stretch, before=paced(arguments.speed, shown))
    spent = monotonic_ns() - begun
    if arguments.json:
        print(json.dumps(verdict_document(recording, verdict, spent), allow_nan=False))
    else:
        print("\n".join(verdict_lines(recording, verdict, spent)))
    return verdict.status


def paced(speed: float | None, shown: Progress) -> Callable[[Section], None]:
    """What is called before each section: waits for its instant, if a speed was asked for."""
    first: list[tuple[int, int]] = []

    def before(section: Section) -> None:
        if section.has_instant:
            shown.show(f"{section.at / SECOND:.1f} s")
            if speed is not None:
                if not first:
                    first.append((section.at, monotonic_ns()))
                begun_at, begun = first[0]
                due = begun + round((section.at - begun_at) / speed)
                sleep(max(0, due - monotonic_ns()) / SECOND)

    return before


def as_test(arguments: argparse.Namespace, path: Path) -> int:
    """Cut a piece of the run that shows what there is to show; write a test, and its recording."""
    # Loaded for this answer only.
    from firmware_runtime.recording.replay.replay_assertion import in_words  # noqa: PLC0415
    from firmware_runtime.recording.what_if.checkout import checked_folder  # noqa: PLC0415
    from firmware_runtime.recording.what_if.piece import (  # noqa: PLC0415
        piece_of,
        span_of_piece,
        test_of_piece,
    )
    from firmware_runtime.recording.what_if.what_if import Question  # noqa: PLC0415

    test: Path = arguments.as_test
    _check(arguments, test)
    question = Question(
        recording=str(path.absolute()),
        assignments=arguments.assignments,
        begin=arguments.begin,
        until=arguments.until,
    )
    checkout = None if arguments.checkout is None else checked_folder(arguments.checkout)
    recording = read_recording(path)
    piece, verdict = piece_of(recording, question, checkout)
    text = test_of_piece(piece, recording, verdict.faults, test.stem, arguments.assignments)
    kept = test.with_suffix(".recording")
    keep_output(kept, piece.content, "--as-test")
    keep_output(test, text.encode(), "--as-test")
    if arguments.json:
        found = {"test": str(test), "recording": str(kept), "bytes": len(piece.content)}
        times = {"from_s": piece.begin / SECOND, "until_s": piece.until / SECOND}
        shown = {"steps": piece.steps, "difference": piece.difference, "faults": verdict.faults}
        print(json.dumps({**found, **times, **shown}, allow_nan=False))
        return Status.OK
    steps = "1 step" if piece.steps == 1 else f"{piece.steps} steps"
    print(f"{test} and {kept} ({len(piece.content)} bytes): {steps}, {span_of_piece(piece)}")
    if piece.difference is not None:
        print(f"  it shows: {in_words(piece.difference)}")
    for fault in verdict.faults:
        print(f"  the run's recording is not whole: {fault}")
    return Status.OK


def _check(arguments: argparse.Namespace, test: Path) -> None:
    """Refuse what cannot be a test, and what would be written over."""
    check_test_file(test, ".recording")
    given = {"BOARD": arguments.board, "--speed": arguments.speed, "-o": arguments.output}
    for name, value in given.items():
        if value is not None:
            raise ConfigError.of_one("replay", f"--as-test with {name}", expected="one of them")
