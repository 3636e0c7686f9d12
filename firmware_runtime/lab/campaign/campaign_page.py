"""The page of a campaign: what was tried, over time and by device, found, fixed, and left."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from firmware_runtime.hal.strike import KINDS, Strike
from firmware_runtime.lab.campaign.findings import Group, group_in, is_wrong
from firmware_runtime.lab.campaign.kept_findings import KeptFinding
from firmware_runtime.lab.campaign.report import Report
from firmware_runtime.lab.campaign.trial import LOST, trial_of
from firmware_runtime.lab.campaign.verdict import SOUND
from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.view import parts
from firmware_runtime.view.parts import (
    Bullets,
    Card,
    Code,
    Figures,
    Lane,
    Lanes,
    Mark,
    Page,
    Part,
    Text,
    Verdict,
    section,
    table,
)

MOST_SOUND: Final = 4000
"""Most sound runs that are drawn; of more every so many-th is."""
MOST_WRONG: Final = 4000
_LANE: Final = 56
_COLOURS: Final = {
    "sound, the fault was reported": "good",
    "sound, it showed in nothing": "tint",
    "with a finding": "bad",
    "lost": "rest",
}


def campaign_page(report: Report, table_file: str = "") -> Page:
    """Return the page of a campaign; `table_file` is where its rows are, for commands."""
    runs = f"{report.runs:,} of {report.space:,} faults"
    return Page(
        title=f"{report.board}: campaign of {runs}",
        opening=[_verdict(report), Figures(items=list(_figures(report)))],
        parts=[
            section("Time and device", _over_time(report, table_file)),
            section("Tried", _tried(report.rows), _said(report)),
            section("Found", *_cards(report, table_file)),
            *([section("Fixed", _fixed(report.kept))] if report.kept else []),
            section("Left", Bullets(items=list(_left(report)))),
        ],
    )


def _verdict(report: Report) -> Verdict:
    wrong = len(report.findings)
    if wrong or report.flakes:
        word = f"{wrong} finding{'s' * (wrong != 1)}"
        return Verdict(judgement="bad", word=word, sentences=[f"{report.flakes} flakes."])
    return Verdict(judgement="good", word="sound", sentences=["No run found anything."])


def _figures(report: Report) -> Iterator[tuple[str, str]]:
    yield "runs", f"{report.runs:,}"
    yield "share of the space", f"{report.share:.1%}"
    yield "silent", str(report.silent)
    yield "crashes, hangs", str(report.crashes)
    if report.run_again:
        yield "run again", str(report.run_again)
        yield "flakes", str(report.flakes)


# Time and device ----------------------------------------------------------------------------------


def _over_time(report: Report, table_file: str) -> Lanes:
    """Each run at the instant of its fault, in the lane of its device, higher up by its kind."""
    sound = [row for row in report.rows if not is_wrong(row)]
    wrong = [row for row in report.rows if is_wrong(row)]
    drawn = [*_every(sound, MOST_SOUND), *_every(wrong, MOST_WRONG)]
    kinds = sorted({str(row["kind"]) for row in drawn}, key=list(KINDS).index)
    heights = {kind: (place + 0.5) / len(kinds) for place, kind in enumerate(kinds)}
    places = {each.group: f"#{_anchor(number)}" for number, each in enumerate(report.findings)}
    lanes: dict[str, list[Mark]] = {}
    for row in drawn:
        mark = _mark(row, heights[str(row["kind"])], places, table_file)
        lanes.setdefault(str(row["device"] or "the robot"), []).append(mark)
    left_out = report.runs - len(drawn)
    title = f"Each run at the instant of its fault{f', {left_out:,} left out' * bool(left_out)}"
    return Lanes(
        title=title,
        lanes=[Lane(name, marks=marks) for name, marks in sorted(lanes.items())],
        height=_LANE,
        colours=_COLOURS,
    )


def _mark(row: Row, height: float, places: Mapping[Group, str], table_file: str) -> Mark:
    of_sound, shown_in_nothing, of_wrong, of_lost = _COLOURS.values()
    colour = of_sound if row["said"] is not None else shown_in_nothing
    if row["outcome"] != SOUND:
        colour = of_lost if row["outcome"] == LOST else of_wrong
    strikes = trial_of(row).strikes
    said = f", {row['said']} after {row['said_after_s']} s" if row["said"] is not None else ""
    what = f": {row['what']}" if row["what"] else ""
    return Mark(
        at=strikes[0].at_s,
        words=f"{', '.join(map(_in_words, strikes))}: {row['outcome']}{what}{said}",
        colour=colour,
        command=_again(row["row"], table_file),
        href=places.get(group_in(places, row), ""),
        height=height,
    )


def _in_words(strike: Strike) -> str:
    span = {None: "for ever", 0.0: "once"}.get(strike.for_s, f"for {strike.for_s} s")
    span = "" if KINDS[strike.kind].is_moment else f" {span}"
    return f"{strike.kind} of {strike.device or 'the robot'} at {strike.at_s:g} s{span}"


def _again(row: object, table_file: str) -> str:
    return f"firmware-runtime campaign rerun {table_file} {row}" if table_file else ""


def _every(rows: Sequence[Row], most: int) -> Sequence[Row]:
    return rows[:: max(1, -(-len(rows) // most))]


# Tried, found, fixed, left ------------------------------------------------------------------------


def _tried(rows: Sequence[Row]) -> parts.Table:
    """Runs by kind and device, and with how many something was found."""
    devices = sorted({str(row["device"] or "the robot") for row in rows})
    tried = Counter((str(row["kind"]), str(row["device"] or "the robot")) for row in rows)
    found = Counter(
        (str(row["kind"]), str(row["device"] or "the robot")) for row in rows if is_wrong(row)
    )

    def cell(kind: str, device: str) -> str:
        count, wrong = tried[kind, device], found[kind, device]
        return "" if count == 0 else f"{count:,}{f', {wrong:,} found' * bool(wrong)}"

    kinds = sorted({kind for kind, _ in tried}, key=list(KINDS).index)
    body = [(kind, *(cell(kind, device) for device in devices)) for kind in kinds]
    return table("Runs by kind of fault and device", ("kind", *devices), body)


def _said(report: Report) -> parts.Table:
    body = [(model, f"{count:,}") for model, count in report.said.items()]
    return table("Reported first, by model and fault", ("fault", "runs"), body)


def _anchor(number: int) -> str:
    return f"finding-{number + 1}"


def _cards(report: Report, table_file: str) -> Iterator[Part]:
    since = {each.finding.group: each.since for each in report.kept}
    if not report.findings:
        yield Text(text="Nothing.")
    for number, each in enumerate(report.findings):
        first, script, known = each.lines
        words: list[str | Code] = [Code(script.strip()), known.strip()]
        if each.recording is not None:
            words.append(Code(f"firmware-runtime view {each.recording}"))
        elif again := _again(each.row, table_file):
            words.append(Code(again))
        if each.test is not None:
            words.append(Code(f"python -m pytest {each.test}"))
        when = since.get(each.group, "")
        yield Card(
            title=_anchor(number).replace("-", " "),
            note=f"since {when}" * bool(when),
            parts=[Text(text=first, look="headline"), Bullets(items=words)],
        )


def _fixed(kept: Sequence[KeptFinding]) -> parts.Table:
    body = [(each.finding.lines[0], each.since, each.fixed) for each in kept if each.fixed]
    return table("Sound when run again", ("finding", "found", "fixed"), body, is_words=True)


def _left(report: Report) -> Iterator[str]:
    yield f"{report.space - report.runs:,} faults of the space were not tried"
    yield report.stated
    yield from (f"left out as known and accepted: {each}" for each in sorted(set(report.left_out)))
    yield from (f"not judged, as its rig has no truth(): {each}" for each in report.not_judged)
    yield from (f"never shown: {each}" for each in report.never)
    yield from (f"arrow of states never taken: {each}" for each in report.never_taken)
