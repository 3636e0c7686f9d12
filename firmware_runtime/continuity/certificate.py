"""The certificate: what every stage's run and its replay have in common, as JSON.

    {"board": "tachobot", "equal": true,
     "stages": {"simulation": {"events": 923, "differences": 0, "first_difference": null, ...}},
     "not_run": {"remote": "..."}, "code_sha256": ..., "settings": {...}, "versions": {...}}

A certificate without a stage that was run is no pass, nor is one with a stage that differs.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import msgspec

from firmware_runtime.continuity.stage_run import Plan, StageRun
from firmware_runtime.part_recording.comparison import Comparison
from firmware_runtime.part_recording.records import Header
from firmware_runtime.system.conditions import system_conditions


@dataclass(frozen=True, slots=True)
class Certificate:
    """The stages of one board."""

    plan: Plan
    runs: Sequence[StageRun]

    @property
    def verdict(self) -> str:
        """In a word or two."""
        if not any(each.has_run for each in self.runs):
            return "no stage was run"
        return "equal" if self.is_equal else "not equal"

    @property
    def is_equal(self) -> bool:
        """Whether at least one stage was run, and all that were are equal to their replays."""
        run = [each for each in self.runs if each.has_run]
        return bool(run) and all(each.is_equal for each in run) and len(self.codes()) == 1

    def codes(self) -> set[str]:
        """Hashes of the code that ran; more than one if it was changed meanwhile."""
        return {header.code_sha256 for header in self._headers()}

    def as_json(self) -> dict[str, Any]:
        """For a program."""
        board = self.plan.board
        headers = self._headers()
        header = headers[0] if headers else None
        return {
            "board": board.name,
            "equal": self.is_equal,
            "stages": {each.stage: _stage(each) for each in self.runs if each.has_run},
            "not_run": {each.stage: each.why_not for each in self.runs if not each.has_run},
            "for_s": self.plan.for_s,
            "role": None if header is None else header.role,
            "components": None if header is None else header.components,
            "code_sha256": None if header is None else header.code_sha256,
            "code": None if header is None else header.code,
            "settings": {
                "source": str(board.source),
                "overrides": list(board.assignments),
                "sha256": board.fingerprint,
                "table_sha256": _sha256(board.table),
            },
            "versions": None if header is None else header.versions,
            "conditions": system_conditions(),
        }

    def _headers(self) -> list[Header]:
        return [each.recording.header for each in self.runs if each.recording is not None]


NOTHING: Final = Comparison(0, 0, 0, None, None, "nothing was recorded")


def _stage(run: StageRun) -> dict[str, Any]:
    found = NOTHING.as_json() if run.comparison is None else run.comparison.as_json()
    found["fault"] = run.failed or found["fault"]
    ended = run.document.get("ended")
    return {
        **found,
        "equal": run.is_equal,
        "ended": ended,
        "clock": run.document.get("clock"),
        "result": run.document.get("result"),
        "link": run.document.get("link"),
        "sample_age_us": run.ages_us,
    }


def _sha256(table: Mapping[str, Any]) -> str:
    return hashlib.sha256(msgspec.json.encode(table, order="deterministic")).hexdigest()
