"""Seeded datagrams against something that judges them, beside an independent judge.

A target is attacked datagram by datagram. For each there are two verdicts: `accepted`, or the
reason for which it is refused; one by the product, one by a reference that was written from the
document alone. They must be the same every time, so the counts by reason are exact.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple, Protocol

ACCEPTED: Final = "accepted"
NO_VALUE: Final = "no value"
"""Neither refused nor a value: a heartbeat, a greeting, a value that has been taken."""
MOST_SHOWN: Final = 20


class Attempt(NamedTuple):
    """One datagram, by what was done to it, and when it arrives, ns."""

    what: str
    datagram: bytes
    at: int


class Target(Protocol):
    """What is attacked, and what is known about what it should do."""

    def attempts(self, count: int) -> Iterable[Attempt]:
        """So many datagrams."""

    def judge(self, attempt: Attempt) -> str:
        """The product's verdict."""

    def expected(self, attempt: Attempt) -> str:
        """The reference's verdict; called after `judge`, for each."""

    def taken(self) -> tuple[object, object]:
        """What entered the product, and what should have; to be compared at the end."""

    def counted(self) -> dict[str, int]:
        """What the product itself has counted as refused, by reason."""


@dataclass
class Result:
    """What came of a sweep."""

    attempts: Counter[str] = field(default_factory=Counter)
    """By what was done to the datagram."""
    verdicts: Counter[str] = field(default_factory=Counter)
    crashes: list[str] = field(default_factory=list)
    disagreements: list[str] = field(default_factory=list)
    counted: dict[str, int] = field(default_factory=dict)
    values_differ: bool = False
    accepted_hostile: int = 0
    """Values that the product accepted and the reference did not."""

    @property
    def is_clean(self) -> bool:
        """Whether nothing crashed, and both judges said the same of everything."""
        refused = Counter(self.verdicts)
        del refused[ACCEPTED], refused[NO_VALUE]
        exact = +Counter(self.counted) == +refused
        return exact and not (self.crashes or self.disagreements or self.values_differ)


def sweep(target: Target, count: int) -> Result:
    """Attack a target with so many datagrams."""
    result = Result()
    for attempt in target.attempts(count):
        result.attempts[attempt.what] += 1
        try:
            verdict = target.judge(attempt)
        except Exception as error:  # noqa: BLE001 -- any is a finding
            result.crashes.append(f"{attempt.what}: {error!r}: {attempt.datagram[:200]!r}")
            continue
        expected = target.expected(attempt)
        result.verdicts[expected] += 1
        if verdict != expected:
            result.accepted_hostile += verdict == ACCEPTED
            fault = f"{attempt.what}: {verdict}, expected {expected}: {attempt.datagram[:200]!r}"
            result.disagreements.append(fault)
    result.counted = target.counted()
    found, expected_values = target.taken()
    result.values_differ = found != expected_values
    return result


def result_text(name: str, result: Result) -> str:
    """What came of it, as a table of reasons."""
    total = result.attempts.total()
    lines = [f"{name}: {total} datagrams", "", f"{'verdict':24} {'expected':>9} {'counted':>9}"]
    for verdict, count in sorted(result.verdicts.items()):
        counted = count if verdict in {ACCEPTED, NO_VALUE} else result.counted.get(verdict, 0)
        lines.append(f"{verdict:24} {count:9} {counted:9}")
    differ = "some" if result.values_differ else "none"
    summary = (
        f"crashes {len(result.crashes)}, values accepted that should not be "
        f"{result.accepted_hostile}, verdicts that differ {len(result.disagreements)}, "
        f"values that differ from what was sent: {differ}"
    )
    found = [*result.crashes, *result.disagreements]
    return "\n".join([*lines, "", summary, *found[:MOST_SHOWN]])
