"""The certificate: that each stage's run replays bit for bit, on the same code and settings.

    {"board": "tachobot", "identical": true, "same_code": true, "same_settings": true,
     "stages": {"simulation": {"identical": true, "events": 2007, "ends": {"whole": {...}}, ...}},
     "not_run": {"remote": "..."}, "code_sha256": ..., "settings": {...}, "versions": {...}}

Stages are not compared with one another: other samples enter in each. A certificate without a stage
that was run is no pass, nor is one with a stage that differs.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import msgspec

from firmware_runtime.errors import Status
from firmware_runtime.lab.continuity.stage_run import StageRun, all_of
from firmware_runtime.lab.stages.staged_run import Staged
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.recorded_board import digest_of
from firmware_runtime.system.conditions import system_conditions

CLAIM: Final = "each stage's run replays bit for bit, on the same code and settings"


@dataclass(frozen=True, slots=True)
class Certificate:
    """The stages of one board."""

    plan: Staged
    """Settings that all of them had."""
    runs: Sequence[StageRun]

    @property
    def verdict(self) -> str:
        """In a word or two."""
        if not self._run:
            return "no stage was run"
        if self.is_identical is None:
            return "not all of it was compared"
        return "identical" if self.is_identical else "not identical"

    @property
    def is_identical(self) -> bool | None:
        """Return whether stages were run, each is its replay, and code and settings were the same.

        None where nothing differs, but not all of it was compared.
        """
        if not (self._run and self.has_same_code and self.has_same_settings):
            return False
        return all_of(each.is_identical for each in self._run)

    @property
    def status(self) -> Status:
        """The exit status that says so."""
        return Status.of_comparison(self.is_identical)

    @property
    def has_same_code(self) -> bool:
        """Return whether no module of the robot had another source in a run or its replay."""
        known: dict[str, str] = {}
        is_same = all(
            known.setdefault(name, digest) == digest
            for header in self._headers()
            for name, digest in header.code.items()
        )
        ends = (end for run in self._run for end in run.ends.values())
        return is_same and not any(end.verdict.code_changed for end in ends)

    @property
    def has_same_settings(self) -> bool:
        """Return whether every run had the same table of settings."""
        return len({_sha256(header.table) for header in self._headers()}) < 2

    def code(self) -> dict[str, str]:
        """SHA-256 of every module of the robot, in whichever stage and end it ran."""
        found: dict[str, str] = {}
        for header in self._headers():
            found |= header.code
        return dict(sorted(found.items()))

    def as_json(self) -> dict[str, Any]:
        """For a program."""
        board, code = self.plan.board, self.code()
        headers = self._headers()
        return {
            "board": board.name,
            "identical": self.is_identical,
            "claim": CLAIM,
            "same_code": self.has_same_code,
            "same_settings": self.has_same_settings,
            "stages": {each.stage: _stage(each) for each in self._run},
            "not_run": {each.stage: each.why_not for each in self.runs if not each.has_run},
            "for_s": self.plan.for_s,
            "code_sha256": digest_of(code) if code else None,
            "code": code,
            "settings": {
                "source": str(board.source),
                "overrides": list(board.assignments),
                "sha256": board.fingerprint,
                "table_sha256": _sha256(board.table),
            },
            "versions": headers[0].versions if headers else None,
            "conditions": system_conditions(),
        }

    @property
    def _run(self) -> list[StageRun]:
        return [each for each in self.runs if each.has_run]

    def _headers(self) -> list[Header]:
        return [end.recording.header for run in self._run for end in run.ends.values()]


def _stage(run: StageRun) -> dict[str, object]:
    difference = run.first_difference
    return {
        "identical": run.is_identical,
        **{count: run.total(count) for count in ("events", "values", "compared", "differences")},
        "first_difference": None if difference is None else difference.as_json(),
        "fault": run.fault,
        "ends": {role: end.verdict.as_json() for role, end in run.ends.items()},
        "ended": run.document.get("ended"),
        "clock": run.document.get("clock"),
        "result": run.document.get("result"),
        "link": run.document.get("link"),
    }


def _sha256(table: Mapping[str, object]) -> str:
    return hashlib.sha256(msgspec.json.encode(table, order="deterministic")).hexdigest()
