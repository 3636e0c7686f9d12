"""What the doctor found, for people and as a document."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby

from firmware_runtime.host.doctor.check import Result, Severity

SCHEMA = 2
_MARKS = {
    Severity.OK: "ok",
    Severity.NOT_APPLICABLE: "-",
    Severity.NOTE: "note",
    Severity.WARNING: "WARN",
    Severity.FAILURE: "FAIL",
}


def doctor_document(results: Sequence[Result], grade: Severity) -> dict[str, object]:
    """Return the findings for JSON; `worst` is the worst of them."""
    return {
        "schema": SCHEMA,
        "checks": [
            {
                "id": result.check.id,
                "status": result.finding.status,
                "seen": result.finding.seen,
                "why": result.check.why,
                "fix": result.fix,
            }
            for result in results
        ],
        "worst": grade,
    }


def doctor_lines(results: Sequence[Result], *, verbose: bool) -> Iterator[str]:
    """Yield a line for each check, in groups, then how many there are of each kind."""
    for group, members in groupby(results, key=lambda result: result.group):
        yield group
        for result in members:
            finding = result.finding
            yield f"  {_MARKS[finding.status]:4}  {result.check.id:24} {finding.seen}"
            if verbose or finding.status.needs_attention:
                yield f"        why:  {result.check.why}"
                yield f"        fix: {result.fix}"
        yield ""
    counts = Counter(result.finding.status for result in results)
    listed = ", ".join(f"{counts[status]} {status}" for status in Severity if counts[status])
    yield f"{len(results)} checks: {listed}"
