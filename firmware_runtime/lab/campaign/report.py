"""The end of a campaign: how much of the space was seen, what was found, what was never reached."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from msgspec import Struct

from firmware_runtime.hal.strike import KINDS
from firmware_runtime.lab.campaign.findings import Finding
from firmware_runtime.lab.campaign.healthy import Healthy
from firmware_runtime.lab.campaign.kept_findings import KeptFinding
from firmware_runtime.lab.campaign.space import Space
from firmware_runtime.lab.sweeps.row import Row

_DEAD: Final = ("crash", "hang", "lost")
_MOST_LISTED: Final = 8


class Report(Struct, frozen=True, kw_only=True):
    """What came of a campaign."""

    board: str
    space: int
    """Faults that there are in the mission."""
    rows: Sequence[Row]
    """The runs, in order of their numbers."""
    findings: Sequence[Finding]
    flakes: int
    """Runs that were another one when they were run again."""
    run_again: int
    """Runs that were run again to know that."""
    never: Sequence[str]
    """Faults of the space, `KIND of DEVICE`, that no run has had, or that never showed."""
    left_out: Sequence[str] = ()
    """Faults that were left out, `KIND` or `KIND:DEVICE`: by choice, or as the rig says."""
    not_judged: Sequence[str] = ()
    """Oracles that could find nothing: its rig says nothing of its world."""
    answers: Sequence[str] = ()
    """What its rig can be asked beside its outputs."""
    limits: Mapping[str, object] = {}
    """What its rig states for campaigns, by attribute."""
    arrows: int = 0
    """Arrows of the robot's state diagrams."""
    never_taken: Sequence[str] = ()
    """Those that no run has taken, healthy ones included, `MODEL: STATE -> STATE`."""
    kept: Sequence[KeptFinding] = ()
    """Findings of the folder, of earlier campaigns, too."""

    @property
    def runs(self) -> int:
        """How many runs there were."""
        return len(self.rows)

    @property
    def share(self) -> float:
        """Share of the space that was seen."""
        return self.runs / self.space if self.space else 0.0

    @property
    def silent(self) -> int:
        """Runs in which the robot went wrong and said nothing."""
        return sum(row["outcome"] == "silent" for row in self.rows)

    @property
    def crashes(self) -> int:
        """Runs that crashed, hung, or whose process was lost."""
        return sum(row["outcome"] in _DEAD for row in self.rows)

    @property
    def is_sound(self) -> bool:
        """Whether nothing was found, no run was lost, and each was the same when run again."""
        return not (self.findings or self.crashes or self.flakes)

    @property
    def said(self) -> dict[str, int]:
        """How many runs each fault of a model was the first one to be reported in."""
        said = Counter(str(row["said"]) for row in self.rows if row["said"] is not None)
        return dict(said.most_common())

    @property
    def stated(self) -> str:
        """Return what its rig answers and states, in words; what is misspelt is not there."""
        answers = ", ".join(self.answers) or "nothing"
        states = ", ".join(f"{name} = {_value(value)}" for name, value in self.limits.items())
        return f"its rig answers {answers}; it states {states or 'no limits of its own'}"

    def as_json(self) -> dict[str, object]:
        """Return it as the command prints it."""
        return {
            "board": self.board,
            "outcomes": dict(Counter(str(row["outcome"]) for row in self.rows).most_common()),
            "said": self.said,
            "left_out": list(self.left_out),
            "not_judged": list(self.not_judged),
            "rig": {"answers": self.answers, "states": self.limits},
            "never": list(self.never),
            "arrows": self.arrows,
            "never_taken": list(self.never_taken),
            "fixed": [
                {**each.finding.as_json(), "fixed": each.fixed} for each in self.kept if each.fixed
            ],
            "run_again": self.run_again,
            "runs": self.runs,
            "space": self.space,
            "share": self.share,
            "silent": self.silent,
            "crashes": self.crashes,
            "flakes": self.flakes,
            "findings": [each.as_json() for each in self.findings],
        }

    @property
    def lines(self) -> Iterator[str]:
        """It in words."""
        for each in self.findings:
            yield from each.lines
        found = f"{len(self.findings)} findings" if len(self.findings) != 1 else "1 finding"
        if self.runs or not self.findings:
            runs = f"{self.runs:,} of {self.space:,} faults of {self.board} ({self.share:.1%})"
            yield f"{runs}: {found}, {self.silent} silent, {self.crashes} crashes"
        else:
            yield f"{self.board} was not struck: {found} without any fault"
        if self.run_again:
            yield f"{self.run_again} run again: {self.flakes} flakes"
        if fixed := sum(bool(each.fixed) for each in self.kept):
            yield f"{fixed} of {len(self.kept)} that were found here are fixed"
        yield self.stated
        if self.left_out:
            yield f"left out: {_listed(self.left_out)}"
        if self.not_judged:
            yield f"not judged: {', '.join(self.not_judged)}: its rig has no truth() with numbers"
        if self.never and self.rows:
            yield f"never shown: {_listed(self.never)}"
        if self.arrows and self.rows:
            taken = f"{self.arrows - len(self.never_taken)} of {self.arrows} arrows of states taken"
            yield f"{taken}; never: {_listed(self.never_taken)}" if self.never_taken else taken

    def __str__(self) -> str:
        return "\n".join(self.lines)

    def check(self) -> None:
        """Fail a test with three lines for each finding."""
        __tracebackhide__ = True
        if not self.is_sound:
            said = [line for each in self.findings for line in each.lines]
            summary = (
                f"{self.crashes} runs ended in the middle, {self.flakes} were others run again"
            )
            raise AssertionError("\n".join(said or [summary]))


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{name}: {_value(each)}' for name, each in value.items())}}}"
    return _listed(value) if isinstance(value, list | tuple) else str(value)


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _MOST_LISTED
    return f"{', '.join(names[:_MOST_LISTED])}{f' and {more} more' if more > 0 else ''}"


def never_taken(found: Healthy, rows: Sequence[Row]) -> list[str]:
    """Return the arrows of state diagrams that no run has taken."""
    taken = {arrow for row in rows for arrow in json.loads(str(row["reached"]))}
    return sorted(found.arrows - found.reached - taken)


def never_shown(space: Space, rows: Sequence[Row]) -> list[str]:
    """Return the faults of a space that no run has shown, by kind and device."""
    shown = {(row["kind"], row["device"]) for row in rows if row["struck"]}
    order = list(KINDS)
    left = [each for each in space.faults if each not in shown]
    left.sort(key=lambda each: order.index(each[0]))
    return [f"{kind} of {device}" if device else kind for kind, device in left]
