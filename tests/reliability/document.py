"""docs/reliability.md, and the table of phases in docs/safety.md: written from kept results.

    python -m tests.reliability.document

Figures stand in benchmarks/results/reliability, where `tests.reliability.run PART --save` puts
them; what is said of surviving mutants in survivors.toml. A test compares.
"""

import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from tests.reliability.results import KEPT, ROOT, Kept, read_kept
from tests.support.safety_table import written_between

DOCUMENT: Final = ROOT / "docs" / "reliability.md"
SAFETY: Final = ROOT / "docs" / "safety.md"
SURVIVORS: Final = Path(__file__).parent / "survivors.toml"
BEGIN: Final = "<!-- phases: written by tests/reliability -->"
END: Final = "<!-- end of the phases -->"
_OPENING: Final = """# How reliable it is, and how that is known

*Written by `python -m tests.reliability.document` from the results in `benchmarks/results/reliability`.*

What finds faults is run again by one command, as long as it is given time for:

    make campaign                                # each part, long: hours
    python -m tests.reliability.run mutants --count 300 --minutes 30 --save

A sample of each part is in the test suite. What a campaign does is in [campaign.md](campaign.md), how outputs are switched off in
[safety.md](safety.md).
"""  # noqa: E501 -- a line of the document


def text(folder: Path = KEPT) -> str:
    """Return the whole document."""
    parts = [_OPENING]
    for name, title, lines in _PARTS:
        kept = read_kept(name, folder)
        body = ["Not measured yet."] if kept is None else [_where(kept), "", *lines(kept)]
        parts.append("\n".join([f"## {title}", "", *body, ""]))
    return "\n".join(parts)


def phases(folder: Path = KEPT) -> list[str]:
    """Return the lines of the table of phases."""
    kept = read_kept("dying", folder)
    return ["Not measured yet."] if kept is None else [_where(kept), "", *_dying(kept)]


def _where(kept: Kept) -> str:
    found = kept.conditions
    took = f"{kept.took_s / 60:.0f} min" if kept.took_s >= 90 else f"{kept.took_s:.0f} s"
    on = f"virtual machine, {found['cpu']}, {found['cpu_count']} processors, {found['python']}"
    if kept.result.is_read:
        when = f"Summed up on {kept.day} at {kept.commit}; measured on a PC ({on})"
    else:
        when = f"Measured on {kept.day} at {kept.commit}, in {took}, on a PC ({on}"
        when += f", load {kept.load:g})"
    return f"{kept.result.summary[0].upper()}{kept.result.summary[1:]}. {when}."


def _campaigns(kept: Kept) -> Iterator[str]:
    columns = ["robot", "runs", "faults there are", "share", "findings", "silent", "crashes"]
    columns += ["run again", "flakes"]
    yield f"| {' | '.join(columns)} |"
    yield "|---" * len(columns) + "|"
    for board, each in kept.result.figures["boards"].items():
        found = [
            *(f"{each['runs']:,}", f"{each['space']:,}", f"{each['share']:.2%}"),
            *(len(each["findings"]), each["silent"], each["crashes"]),
            *(each["run_again"], each["flakes"]),
        ]
        yield f"| {board} | {' | '.join(map(str, found))} |"
    findings = [
        f"- {board}: {found['oracle']} of {found['model']}: {found['what']}; `{found['faults'][0]}`"
        for board, each in kept.result.figures["boards"].items()
        for found in each["findings"]
        if found["faults"]
    ]
    if findings:
        yield from (
            "",
            "Found then; [campaign-findings.md](campaign-findings.md) says what is fixed:",
            "",
            *findings,
        )


def _planted(kept: Kept) -> Iterator[str]:
    yield "| mistake | robot | struck | first finding |"
    yield "|---|---|---|---|"
    for row in kept.result.figures["rows"]:
        lines = row["finding"] or ["none"]
        script = "".join(f", `{each}`" for each in lines[1:])
        struck = row["device"] or "nothing"
        yield f"| {row['mistake']} | {row['board']} | {struck} | {lines[0]}{script} |"


def _dying(kept: Kept) -> Iterator[str]:
    yield "| phase | what happens | trials | off and stays so | went on | median, ms | worst, ms |"
    yield "|---|---|---|---|---|---|---|"
    for row in kept.result.figures["rows"]:
        if row["trials"]:
            yield "| " + " | ".join(map(_cell, row.values())) + " |"


def _in_real_time(kept: Kept) -> Iterator[str]:
    yield "| what befell it | robot | runs | went on | ended with a reason | wrong |"
    yield "|---|---|---|---|---|---|"
    for row in kept.result.figures["rows"]:
        yield "| " + " | ".join(map(_cell, row.values())) + " |"


def _fuzzing(kept: Kept) -> Iterator[str]:
    yield "| what reads | inputs | of |"
    yield "|---|---|---|"
    targets = kept.result.figures["targets"]
    for each in targets:
        yield f"| {each['name']} | {each['inputs']:,} | {each['commit']} |"
    findings = [(each["name"], each["finding"].partition(" (")[0]) for each in targets]
    if said := [f"- {name}: {finding}" for name, finding in findings if finding]:
        yield from ("", "Found then:", "", *said)


def _mutants(kept: Kept) -> Iterator[str]:
    figures = kept.result.figures
    yield "| room | mutants | noticed | share |"
    yield "|---|---|---|---|"
    for room, each in figures["rooms"].items():
        tried, noticed = each["tried"], each["noticed"]
        yield f"| {room} | {tried} | {noticed} | {noticed / tried:.0%} |"
    judged: Mapping[str, str] = tomllib.loads(SURVIVORS.read_text(encoding="utf-8"))
    if figures["survivors"]:
        said = [judged.get(each, "") for each in figures["survivors"]]
        same = sum(each.startswith("changes nothing") for each in said)
        others = figures["tried"] - same
        share = f"{figures['noticed'] / others:.0%}"
        yield from (
            "",
            f"{same} of the others change nothing; of {others} that do {share} were noticed.",
            "",
            "| mutant | judgement |",
            "|---|---|",
        )
    for each in figures["survivors"]:
        escaped = each.replace("|", "\\|")
        yield f"| `{escaped}` | {judged.get(each, 'not judged')} |"


def _soak(kept: Kept) -> Iterator[str]:
    yield "| robot | of | hours | faults | runs | activations | memory grew by, MB | wrong |"
    yield "|---|---|---|---|---|---|---|---|"
    for each in kept.result.figures["boards"]:
        found = [
            each.get("commit") or kept.commit,
            *(f"{each['robot_s'] / 3600:.2f}", f"{each['faults']:,}", each["runs"]),
            *(f"{each['activations']:,}", each["growth_mb"], "; ".join(each["wrong"]) or "nothing"),
        ]
        yield f"| {each['board']} | {' | '.join(map(str, found))} |"


def _cell(value: Any) -> str:  # noqa: ANN401 -- of a table
    return "" if value is None else str(value)


_PARTS: Final = (
    ("campaigns", "Single faults at transactions", _campaigns),
    ("planted", "Mistakes that were planted", _planted),
    ("dying", "Dying and hanging by phase", _dying),
    ("networks", "Networks that fail", _in_real_time),
    ("machines", "Machines that fail", _in_real_time),
    ("fuzzing", "Wire formats and parsers", _fuzzing),
    ("mutants", "Mutants", _mutants),
    ("soak", "Soak, in virtual time", _soak),
    ("soak-real", "Soak, in real time", _soak),
)


def main() -> None:
    """Write both."""
    DOCUMENT.write_text(text(), encoding="utf-8")
    written_between(BEGIN, END, SAFETY, phases())
    sys.stdout.write(f"{DOCUMENT}\n")


if __name__ == "__main__":
    main()
