"""`firmware-runtime campaign BOARD`, `campaign show`, `campaign rerun`: what breaks a robot."""

import argparse
import json
import re
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Final

from firmware_runtime.cli.arguments import (
    SubParsers,
    add_board,
    add_duration,
    add_output,
    add_verb,
    positive,
)
from firmware_runtime.cli.many_runs import RowProgress, add_how, interruptible
from firmware_runtime.cli.written import check_page_file
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.campaign.again import number_of, rerun, rerun_many
from firmware_runtime.lab.campaign.campaign_page import campaign_page
from firmware_runtime.lab.campaign.campaigning import carry_out, report_of
from firmware_runtime.lab.campaign.findings import is_same, is_wrong
from firmware_runtime.lab.campaign.kept_findings import (
    Again,
    read_findings,
    rerun_findings,
    watched_code,
)
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.report import Report
from firmware_runtime.lab.campaign.verdict import SOUND
from firmware_runtime.lab.sweeps.sweep_table import read_table
from firmware_runtime.view.page_file import write_page

_SUMMARY: Final = "Strike a robot with each fault at each moment, and say what breaks it."
_ABOUT: Final = """
In the space: each kind of `doubles fault --list` that fits a device, at each transaction of that
device in a mission, the start included; once, for a second, for ever; brown-outs, stalls, pushes
and being disarmed at each of these moments; what holds a bus up on all of the bus, too; what is
over at once again and again; a sample of pairs by --pairs. Not in it: load, friction and walls,
disks and networks, and new settings. A robot is judged from outside, by its outputs, the truth of
its world, and the faults that its models report: it may be off, or degraded and say so, within
--within. `campaign show FILE` sums a table up, with -o or --html PAGE.html as a page.
`campaign rerun FILE ROW` runs a row again and says whether it is the same, to the bit, with
--runs N in place of ROW so many rows, spread evenly; `campaign rerun FOLDER` all findings that
--findings has kept, and says which are fixed. With --watch those are run again on every save of the
robot's files, and nothing else is. Exit status 0: nothing was found; 1: something was, or a row
that was run again is another.
"""
_UNITS: Final = {"": 1.0, "s": 1.0, "m": 60.0, "h": 3600.0}
_MISSION_S: Final = 10.0


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "campaign", _SUMMARY, execute)
    verb.epilog = _ABOUT
    add_board(verb, about="a board's name or file; or `show`, or `rerun`")
    verb.add_argument("file", metavar="FILE", nargs="?", type=Path, help="of show and rerun")
    verb.add_argument("row", metavar="ROW", nargs="?", type=int, help="of rerun")
    verb.add_argument("--json", action="store_true", help="print one JSON object")
    add_output(verb, "a row for each run, into FILE.csv or FILE.parquet; show: a page")
    verb.add_argument(
        "--html", type=Path, metavar="FILE", help="write a page of it: tried, found, fixed, left"
    )
    add_duration(verb, f"length of the mission; default {_MISSION_S:g}", dest="for_s")
    verb.add_argument("--seed", type=int, metavar="N", help="world.seed; default: the board's")
    verb.add_argument(
        "--within",
        type=positive,
        metavar="SECONDS",
        help="in which outputs are off or a fault is reported; default: what the rig says, or 0.3",
    )
    verb.add_argument(
        "--without",
        action="append",
        default=[],
        metavar="KIND[:DEVICE]",
        help="leave out a fault that is known and accepted; may be repeated",
    )
    verb.add_argument(
        "--budget", type=_span, metavar="TIME", help="such as 90s, 2m, 1h: an even sample"
    )
    verb.add_argument(
        "--pairs",
        type=int,
        default=0,
        metavar="N",
        help="so many pairs of faults within a second, beside each that strikes alone",
    )
    verb.add_argument("--runs", type=int, metavar="N", help="an even sample of so many")
    verb.add_argument(
        "--findings",
        type=Path,
        metavar="FOLDER",
        help="keep each finding there: its recording, and a test that fails until it is fixed",
    )
    verb.add_argument(
        "--watch",
        action="store_true",
        help="run those kept in --findings again, now and on every save, until Ctrl-C",
    )
    add_how(verb, "campaign")


def execute(arguments: argparse.Namespace) -> int:
    """Run a campaign, show one, or run something of it again."""
    if arguments.board == "show":
        return _show(arguments)
    if arguments.board == "rerun":
        if arguments.file is not None and arguments.file.is_dir():
            return _rerun_findings(arguments)
        return _rerun(arguments) if arguments.runs is None else _rerun_many(arguments)
    if arguments.file is not None:
        fault = f"{arguments.file}: expected options only"
        raise ConfigError.of_one("campaign", fault)
    return _watch(arguments) if arguments.watch else _campaign(arguments)


class _CampaignProgress(RowProgress):
    """How far the runs are, and then the findings, each of which is run some times more."""

    def shorten(self, number: int, count: int) -> None:
        """Say which finding is made shorter."""
        self.say(f"finding {number} of {count} is made shorter")


def _campaign(arguments: argparse.Namespace) -> int:
    if arguments.html is not None:
        check_page_file(arguments.html, "--html")
    mission = Mission(
        board=arguments.board,
        assignments=tuple(arguments.assignments),
        for_s=arguments.for_s or _MISSION_S,
        seed=arguments.seed,
        within_s=arguments.within,
        without=tuple(arguments.without),
        pairs=arguments.pairs,
    )
    with interruptible(arguments.output), closing(_CampaignProgress("with findings")) as progress:
        report = carry_out(
            mission,
            arguments.output,
            runs=arguments.runs,
            budget_s=arguments.budget,
            findings=arguments.findings,
            workers=arguments.workers,
            scheduler=arguments.scheduler,
            resume=arguments.resume,
            progress=progress,
            shortening=progress.shorten,
        )
    if arguments.html is not None:
        table = "" if arguments.output is None else str(arguments.output)
        write_page(campaign_page(report, table), arguments.html, "--html")
    return _told(report, arguments)


def _told(report: Report, arguments: argparse.Namespace) -> int:
    print(json.dumps(report.as_json()) if arguments.json else report)
    return Status.OK if report.is_sound else Status.MODEL_ERROR


def _show(arguments: argparse.Namespace) -> int:
    if arguments.file is None or arguments.row is not None:
        raise ConfigError.of_one("campaign", "no FILE, or a ROW", expected="campaign show FILE")
    if arguments.output is not None and arguments.html is not None:
        raise ConfigError.of_one("campaign", "-o and --html", expected="one of them, for the page")
    page, option = arguments.output or arguments.html, "--html" if arguments.html else "-o"
    if page is not None:
        check_page_file(page, option)
    kept = [] if arguments.findings is None else read_findings(arguments.findings)
    report = report_of(read_table(arguments.file, "campaign").rows, kept)
    if page is None:
        return _told(report, arguments)
    write_page(campaign_page(report, str(arguments.file)), page, option)
    print(page)
    return Status.OK


def _watch(arguments: argparse.Namespace) -> int:
    """Run what was found again on every save, in a fresh process each time; ends with Ctrl-C."""
    if arguments.findings is None:
        expected = "--findings FOLDER, where a campaign has kept some"
        raise ConfigError.of_one("campaign", "--watch without findings", expected=expected)
    words = ["campaign", "rerun", str(arguments.findings), *(["--json"] * arguments.json)]
    for _ in watched_code(arguments.findings).saves():
        subprocess.run([sys.executable, "-m", "firmware_runtime.cli", *words], check=False)  # noqa: S603 -- this command
        if not arguments.json:
            print("waiting for a save (Ctrl-C ends)", flush=True)
    return Status.OK


def _rerun_findings(arguments: argparse.Namespace) -> int:
    if arguments.row is not None or arguments.assignments:
        fault = "ROW and --set belong to a table and to a board"
        raise ConfigError.of_one("campaign", fault, expected="campaign rerun FOLDER")
    left = 0
    found = []
    for again in rerun_findings(arguments.file):
        kept, outcome, what = again
        left += not kept.fixed
        finding = kept.finding.as_json()
        found.append(
            {"finding": finding, "fixed": kept.fixed or None, "outcome": outcome, "what": what}
        )
        if not arguments.json:
            state = f"fixed, {kept.fixed}" if kept.fixed else _still(again)
            print(f"{state}: {kept.finding.lines[0]}", flush=True)
    if arguments.json:
        print(json.dumps({"findings": found, "left": left}), flush=True)
    else:
        print(f"{len(found) - left} of {len(found)} fixed")
    return Status.MODEL_ERROR if left else Status.OK


def _still(again: Again) -> str:
    """Return the state of a finding that is not known to be fixed, in words."""
    if again.outcome == SOUND:
        return "not judged without the oracle of its test"
    if again.outcome == again.kept.finding.oracle:
        return f"still {again.outcome}"
    return f"now {again.outcome}, {again.what}; it was"


def _rerun(arguments: argparse.Namespace) -> int:
    faults = [f"no {name}; expected campaign rerun FILE ROW" for name in _missing(arguments)]
    if arguments.row is None and arguments.file is not None and not arguments.file.exists():
        faults = [
            f"there is no {arguments.file}; expected a table of runs, or a folder of findings"
        ]
    if arguments.assignments:
        faults.append("--set belongs to a campaign of a board; expected campaign rerun FILE ROW")
    if faults:
        raise ConfigError("campaign", faults)
    before = read_table(arguments.file, "campaign").row(arguments.row)
    now = rerun(before)
    same = is_same(before, now)
    if arguments.json:
        print(json.dumps({"row": now, "is_same": same}))
        return Status.OK if same else Status.MODEL_ERROR
    what = f", {now['what']}" if is_wrong(now) else ""
    where = f"{now['kind']} of {now['device'] or 'the robot'}"
    print(f"row {arguments.row}: {where}: {now['outcome']}{what}")
    said = now["said"]
    print(
        f"first reported: {said} after {now['said_after_s']} s" if said else "nothing was reported"
    )
    other = f"another than in the table: {before['outcome']}; its robot may have changed since"
    print("the same as in the table" if same else other)
    return Status.OK if same else Status.MODEL_ERROR


def _rerun_many(arguments: argparse.Namespace) -> int:
    if arguments.file is None or arguments.row is not None or arguments.runs < 1:
        expected = "campaign rerun FILE --runs N, of 1 or more"
        raise ConfigError.of_one("campaign", "no FILE, a ROW, or no runs", expected=expected)
    rows = read_table(arguments.file, "campaign").rows
    with closing(RowProgress("another")) as progress:
        done, others = rerun_many(rows, arguments.runs, arguments.workers, progress)
    if arguments.json:
        numbers = [number_of(each) for each in others]
        print(json.dumps({"run_again": done, "flakes": len(others), "rows": numbers}))
    else:
        for each in others:
            print(f"row {each['row']}: {each['outcome']} now, or another course")
        print(f"{done:,} of {len(rows):,} rows run again: {len(others)} flakes")
    return Status.MODEL_ERROR if others else Status.OK


def _missing(arguments: argparse.Namespace) -> list[str]:
    return [
        name for name, value in (("FILE", arguments.file), ("ROW", arguments.row)) if value is None
    ]


def _span(text: str) -> float:
    """A span of time on the command line, such as `90`, `90s`, `2m` or `1h`, in s."""
    found = re.fullmatch(r"([0-9.]+)([smh]?)", text)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a time such as 90s, 2m or 1h")
    return positive(found[1]) * _UNITS[found[2]]
