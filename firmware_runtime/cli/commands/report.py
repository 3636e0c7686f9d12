"""`firmware-runtime report [BOARD|FILE] -o FILE.html`: one page on a run's timing."""

import argparse

from firmware_runtime.cli.after_virtual_run import say_if_last_run_was_virtual
from firmware_runtime.cli.arguments import SubParsers, add_kept, add_output, add_verb, path_of
from firmware_runtime.cli.written import write_text
from firmware_runtime.errors import Status
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.summary import summary
from firmware_runtime.view.page import page_of
from firmware_runtime.view.report.report import report


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    about = "Make a page of a run's timing, under way or over; reading changes nothing."
    verb = add_verb(verbs, "report", about, execute)
    add_kept(verb)
    add_output(verb, "where to write it", metavar="FILE.html", required=True)


def execute(arguments: argparse.Namespace) -> int:
    """Write the page and say where it is."""
    path = path_of(arguments.kept)
    statistics = read_statistics(path)
    say_if_last_run_was_virtual(path, statistics)
    write_text(page_of(report(statistics, summary(statistics.figures()))), arguments.output)
    return Status.OK
