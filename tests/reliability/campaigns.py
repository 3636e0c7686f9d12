"""Campaigns of robots: single faults at transactions of their missions.

    python -m tests.reliability.run campaigns --tables all.csv --again 10000 --save

An even sample of each mission, in so many minutes; with `--tables` what campaigns have made before.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from firmware_runtime.board.assignments import assigned
from firmware_runtime.lab.campaign import campaign
from firmware_runtime.lab.campaign.again import rerun_many
from firmware_runtime.lab.campaign.campaigning import report_of
from firmware_runtime.lab.campaign.report import Report
from firmware_runtime.lab.campaign.trial import trial_of
from firmware_runtime.lab.sweeps.partial import partial_of
from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.lab.sweeps.sweep_table import read_table
from tests.reliability.results import BUILD, Result

MISSIONS: Final[Mapping[str, tuple[str, Mapping[str, object]]]] = {
    **{board: (board, {}) for board in ("tachobot", "detective", "balancing", "pan_tilt")},
    "tachobot that hovers": ("tachobot", {"controller.mode": "free"}),
}
"""The board and the settings of each."""
BOARDS: Final = tuple(dict.fromkeys(board for board, _ in MISSIONS.values()))


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    parser.add_argument("--missions", nargs="+", choices=MISSIONS, default=list(MISSIONS))
    parser.add_argument("--minutes", type=float, help="for all of them together; default: all")
    parser.add_argument("--workers", type=int)
    parser.add_argument("--tables", nargs="+", type=Path, help="read those of campaigns instead")
    parser.add_argument("--again", type=int, default=100, help="rows of each table to run again")


def execute(arguments: argparse.Namespace) -> Result:
    """Carry out one campaign after the other, or read their tables."""
    tables = arguments.tables
    made = _read(tables, arguments) if tables else _carried_out(arguments)
    boards = dict(made)
    each = boards.values()
    findings = sum(len(one["findings"]) for one in each)
    wrong = sum(one["crashes"] + one["flakes"] for one in each)
    return Result(
        name="campaigns",
        summary=f"{sum(one['runs'] for one in each):,} runs of {len(boards)} "
        f"mission{'s' * (len(boards) != 1)}, "
        f"{findings} findings, {wrong} crashes or flakes",
        is_sound=findings == 0 and wrong == 0,
        figures={"boards": boards},
        is_read=bool(tables),
    )


def _carried_out(arguments: argparse.Namespace) -> Iterator[tuple[str, dict[str, Any]]]:
    missions = arguments.missions
    share_s = None if arguments.minutes is None else 60 * arguments.minutes / len(missions)
    for name in missions:
        board, settings = MISSIONS[name]
        output = BUILD / f"{name}.csv"
        partial_of(output).unlink(missing_ok=True)  # of the last one, whose time was over
        report = campaign(
            board,
            set=settings,
            budget_s=share_s,
            workers=arguments.workers,
            output=output,
            findings=BUILD / f"findings-{name}",
        )
        sys.stdout.write(f"{report}\n")
        sys.stdout.flush()
        yield name, _figures(report)


def _figures(report: Report) -> dict[str, Any]:
    """What a report says, without where it keeps its findings, which only this machine has."""
    said: dict[str, Any] = report.as_json()
    for each in (*said["findings"], *said["fixed"]):
        for place in ("recording", "test"):
            each.pop(place, None)
    return said


def _read(
    tables: list[Path], arguments: argparse.Namespace
) -> Iterator[tuple[str, dict[str, Any]]]:
    for table in tables:
        rows = read_table(table).rows
        report = report_of(rows)
        sys.stdout.write(f"{report}\n")
        again, others = rerun_many(rows, arguments.again, arguments.workers)
        yield _name(rows[0]), {**_figures(report), "run_again": again, "flakes": len(others)}


def _name(row: Row) -> str:
    """The mission of a row, by its name; the board's where it is none of these."""
    found = trial_of(row).mission
    settings = dict(map(assigned, found.assignments))
    for name, mission in MISSIONS.items():
        if mission == (found.board, settings):
            return name
    return found.board
