"""What a check saw, and how bad that is."""

from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """From good to bad; what does not apply, or cannot be seen, counts as good."""

    NOT_APPLICABLE = "not-applicable"
    OK = "ok"
    NOTE = "note"
    WARNING = "warning"
    FAILURE = "failure"

    @property
    def needs_attention(self) -> bool:
        """Whether there is something to fix or to know."""
        return self in {Severity.NOTE, Severity.WARNING, Severity.FAILURE}


@dataclass(frozen=True, slots=True)
class Finding:
    """One check's answer, in words; `fix` where it is more exact than the check's own."""

    status: Severity
    seen: str
    fix: str | None = None


def ok(seen: str) -> Finding:
    """Nothing to fix."""
    return Finding(Severity.OK, seen)


def note(seen: str, fix: str | None = None) -> Finding:
    """Worth knowing."""
    return Finding(Severity.NOTE, seen, fix)


def warning(seen: str, fix: str | None = None) -> Finding:
    """It works, but not as well as it could, or not for long."""
    return Finding(Severity.WARNING, seen, fix)


def failure(seen: str, fix: str | None = None) -> Finding:
    """A run will fail, or not get what its board needs."""
    return Finding(Severity.FAILURE, seen, fix)


def not_applicable(reason: str) -> Finding:
    """There is nothing to examine, or it is not shown to this user."""
    return Finding(Severity.NOT_APPLICABLE, reason)


def worst(findings: list[Finding]) -> Severity:
    """The worst of all; not-applicable counts as ok."""
    order = list(Severity)
    return max((finding.status for finding in findings), key=order.index, default=Severity.OK)
