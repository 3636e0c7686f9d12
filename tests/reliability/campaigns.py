"""Campaigns of robots, an even sample of each: single faults at transactions of their missions."""

import argparse
import sys
from typing import Final

from firmware_runtime.lab.campaign import campaign
from tests.reliability.results import BUILD, Result

BOARDS: Final = ("tachobot", "detective", "balancing", "pan_tilt", "underwater")
ACCEPTED: Final = {
    "pan_tilt": ("offset:eyes", "scale:eyes", "freeze-axis:eyes", "wrong-byte:eyes", "flip:eyes")
}
"""Faults that no second source could tell from the world; see docs/campaign.md."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    parser.add_argument("--boards", nargs="+", choices=BOARDS, default=list(BOARDS))
    parser.add_argument("--minutes", type=float, help="for all of them together; default: all")
    parser.add_argument("--workers", type=int)


def execute(arguments: argparse.Namespace) -> Result:
    """Carry out one campaign after the other."""
    found = {}
    share_s = None if arguments.minutes is None else 60 * arguments.minutes / len(arguments.boards)
    for board in arguments.boards:
        report = campaign(
            board,
            budget_s=share_s,
            without=ACCEPTED.get(board, ()),
            workers=arguments.workers,
            output=BUILD / f"{board}.csv",
            findings=BUILD / f"findings-{board}",
        )
        sys.stdout.write(f"{report}\n")
        sys.stdout.flush()
        found[board] = report
    findings = sum(len(each.findings) for each in found.values())
    wrong = sum(each.crashes + each.flakes for each in found.values())
    runs = sum(each.runs for each in found.values())
    return Result(
        name="campaigns",
        summary=f"{runs} runs of {len(found)} robots, {findings} findings, "
        f"{wrong} crashes or flakes",
        is_sound=findings == 0 and wrong == 0,
        figures={"boards": {board: each.as_json() for board, each in found.items()}},
    )
