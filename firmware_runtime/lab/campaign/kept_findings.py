"""Findings of a folder: kept from campaign to campaign, run again, and known as fixed when sound.

`campaign --findings FOLDER` keeps them there as `findings.json`, beside recordings and tests.
"""

import os
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, NamedTuple

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.campaign.asked import Oracle
from firmware_runtime.lab.campaign.findings import Finding, make_folder
from firmware_runtime.lab.campaign.trial import alone
from firmware_runtime.lab.campaign.verdict import SOUND
from firmware_runtime.lab.campaign.without_faults import wrong_without_faults
from firmware_runtime.recording.recorded_board import code_of
from firmware_runtime.recording.what_if.watch import Watched
from firmware_runtime.statistics.json_values import NOT_JSON
from firmware_runtime.system.atomic_file import keep_output, read_content
from firmware_runtime.system.own_folder import nearest

_FILE: Final = "findings.json"


class KeptFinding(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A finding, the day on which it was found, and the one on which it was seen to be fixed."""

    finding: Finding
    since: str
    fixed: str = ""


class Again(NamedTuple):
    """A finding as it is now, and what became of its run."""

    kept: KeptFinding
    outcome: str
    what: str
    """A sentence about that; empty where it is sound."""


def read_findings(folder: Path) -> list[KeptFinding]:
    """Return what a folder keeps, in order of the day. Raises ConfigError where it keeps none."""
    path = folder / _FILE
    try:
        return msgspec.json.decode(read_content(path), type=list[KeptFinding])
    except NOT_JSON as error:
        expected = "what `campaign --findings` keeps"
        raise ConfigError.of_one(str(path), str(error), expected=expected) from error


def folder_faults(folder: Path) -> Iterator[str]:
    """Yield what keeps findings from being kept in a folder, before there are any."""
    there = nearest(folder)
    if not (there.is_dir() and os.access(there, os.W_OK | os.X_OK)):
        yield f"--findings: {folder} cannot be written; expected a folder that can"
    elif (folder / _FILE).exists():
        try:
            read_findings(folder)
        except ConfigError as error:
            yield f"--findings: {error}"


def keep_findings(
    folder: Path, board: str, found: Sequence[Finding], oracle: Oracle | None = None
) -> list[KeptFinding]:
    """Put what a campaign of a board has found beside what its folder has, and return all.

    Those of this board that it has not found are run again, unless the robot is wrong without any
    fault: then nothing else can be known of it. Raises ConfigError.
    """
    before = read_findings(folder) if (folder / _FILE).exists() else []
    now = {_key(each): each for each in found}
    is_judged = all(each.faults for each in found)
    kept = []
    for each in before:
        again = now.pop(_key(each.finding), None)
        if again is not None:
            each = replace(each, finding=again, fixed="")  # noqa: PLW2901 -- it is the same one
        elif each.finding.mission.board == board and is_judged:
            each = _run_again(each, oracle).kept  # noqa: PLW2901
        kept.append(each)
    kept += [KeptFinding(finding=each, since=_today()) for each in now.values()]
    _keep(folder, kept)
    return kept


def rerun_findings(folder: Path) -> Iterator[Again]:
    """Run all of them again, and keep which are fixed. Raises ConfigError where there are none."""
    found = []
    for each in read_findings(folder):
        again = _run_again(each)
        found.append(again.kept)
        yield again
    _keep(folder, found)


def watched_code(folder: Path) -> Watched:
    """Return the files of the robots that findings are about. Raises ConfigError."""
    boards = {each.finding.mission.board for each in read_findings(folder)}
    modules: set[str] = set()
    for name in boards:
        parts = with_all_below(board_in_force(name).unconnected().model)
        modules |= code_of(each for each in parts if isinstance(each, Atomic)).keys()
    watched = Watched(None, modules)
    watched.folders += [Path(name).absolute().parent for name in boards if Path(name).is_file()]
    return watched


def _run_again(kept: KeptFinding, oracle: Oracle | None = None) -> Again:
    """Run one; what a test's own oracle has found is not known to be fixed without it."""
    outcome, what = _outcome(kept.finding, oracle)
    is_known = oracle is not None or not kept.finding.needs_oracle
    is_fixed = is_known and outcome == SOUND
    return Again(replace(kept, fixed=(kept.fixed or _today()) if is_fixed else ""), outcome, what)


def _outcome(finding: Finding, oracle: Oracle | None) -> tuple[str, str]:
    if not finding.faults:
        wrong = wrong_without_faults(finding.mission, oracle)
        return (SOUND, "") if wrong is None else (wrong.oracle, wrong.what)
    row = alone(finding.trial, oracle=oracle)
    return str(row["outcome"]), str(row["what"])


def _keep(folder: Path, kept: Sequence[KeptFinding]) -> None:
    make_folder(folder)
    content = msgspec.json.format(msgspec.json.encode(kept))
    keep_output(folder / _FILE, content + b"\n", "--findings")


def _key(finding: Finding) -> tuple[str, ...]:
    return finding.mission.board, *finding.group


def _today() -> str:
    return datetime.now(UTC).date().isoformat()
