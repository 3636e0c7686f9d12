"""`firmware-runtime export RUN -o FILE.mcap|.csv|.parquet`: a recording for other programs."""

import argparse
import sys
from collections.abc import Collection, Iterator
from pathlib import Path

from firmware_runtime.cli.written import check_output
from firmware_runtime.devs.senders import Senders
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError, Status, did_you_mean
from firmware_runtime.recording.blackbox.listing import span_of
from firmware_runtime.recording.blackbox.locations import find_recording
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.mcap_file import mcap_of
from firmware_runtime.recording.exports.table_file import csv_of, long_table, parquet_of, wide_table
from firmware_runtime.recording.exports.typed_values import (
    Sent,
    entrance,
    model_of,
    passed,
    sections_between,
)
from firmware_runtime.recording.replay.verdict import Stretch
from firmware_runtime.system.atomic_file import keep_output


def export_run(arguments: argparse.Namespace, output: Path) -> int:
    """Write the file, and say what in the recording is not whole."""
    check_output(output, [output.suffix])
    recording = read_recording(find_recording(arguments.board))
    header = recording.header
    if arguments.assignments:
        fault = "--set: has no effect on a run; its values are as they were recorded"
        raise ConfigError.of_one("export", fault)
    board = board_of(header)
    begin, until = arguments.begin or 0, arguments.until
    stretch = Stretch(begin, NEVER if until is None else until)
    if (last := span_of(recording)[1]) < begin:
        fault = f"the run ends at {last / SECOND:g} s; expected an instant before"
        raise ConfigError.of_one(f"--from {begin / SECOND:g}", fault)
    if output.suffix == ".mcap":
        if arguments.port is not None:
            raise ConfigError.of_one("export", "--port: has no effect on MCAP", expected="a table")
        sections = sections_between(recording, stretch.begin, stretch.until)
        content = mcap_of(header, board, sections, recording.dates())
    else:
        model = model_of(header, board)
        sent = passed(recording, board, stretch.begin, stretch.until)
        if arguments.port is None:
            columns = long_table(sent, recording.dates())
        else:
            senders = Senders(model).of(arguments.port)
            columns = wide_table(
                _of_port(
                    sent, arguments.port, senders, [*header.ports, *map(entrance, model.in_ports)]
                ),
                recording.dates(),
            )
        content = csv_of(columns) if output.suffix == ".csv" else parquet_of(columns)
    keep_output(output, content)
    for fault in recording.faults():
        print(f"firmware-runtime: not whole: {fault}", file=sys.stderr)
    print(output)
    return Status.OK


def _of_port(
    sent: Iterator[Sent], port: str, senders: Collection[str], ports: list[str]
) -> Iterator[Sent]:
    """What passed one port. Raises ConfigError for one that the recording has not."""
    if not set(senders) <= set(ports):
        fault = f"{port!r}: no such port in the recording{did_you_mean(port, ports)}"
        raise ConfigError.of_one("--port", fault, expected=f"one such as {ports[0]}")
    return (each for each in sent if each.port in senders)
