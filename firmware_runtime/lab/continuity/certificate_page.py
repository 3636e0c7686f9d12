"""The certificate as a self-contained page: what differs first, then the stages side by side."""

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import islice
from typing import Final, NamedTuple

from firmware_runtime.board.ends import role_without_hardware
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rigs import rig_for, shown_by
from firmware_runtime.board.roles import ROBOT, components_of, crossings
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.senders import Senders
from firmware_runtime.devs.time import NEVER, SECOND, format_time
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.lab.continuity.certificate import CLAIM, Certificate
from firmware_runtime.lab.continuity.stage_run import StageRun
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.typed_values import (
    Sent,
    model_of,
    ports_of,
    sections_between,
    values_in,
)
from firmware_runtime.recording.replay.difference import Difference
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.number_formats import milliseconds
from firmware_runtime.statistics.value_table import cells_of
from firmware_runtime.view.parts import (
    Beside,
    Page,
    Part,
    Section,
    Series,
    Table,
    Text,
    Verdict,
    curve,
    facts,
    on_common_axes,
    section,
    table,
)

Points = list[tuple[float, float]]

MOST_CURVES: Final = 4
_ABOUT: Final = (
    "What entered a stage's processes at their edges entered the same drivers and models again in "
    "virtual time; all that left them was compared, floats to the bit. Stages were not compared "
    "with one another: other samples enter in each."
)


class Signals(NamedTuple):
    """Ports of a board by path below the root, as they go by in its recordings."""

    shown: str | None
    """Port whose value is drawn over time; None where the board's rig shows nothing."""
    commands: tuple[str, ...]
    """Senders of what leaves the role that computes; none of a board without roles."""


def signals_of(board: Board) -> Signals:
    """Return the ports that are drawn of a board. Raises ConfigError for one without a rig."""
    model, roles = board.unconnected().model, board.settings.roles
    senders, own = Senders(model), list[str]()
    if roles:
        own += components_of(roles, model, role_without_hardware(board))
    leaving = (each for each in sorted(crossings(roles, model)) if each.partition(".")[0] in own)
    commands = dict.fromkeys(sender for each in leaving for sender in senders.of(each))
    rig = rig_for(board, WorldClock())
    rig.attach(model)
    port = shown_by(rig, board)
    return Signals(None if port is None else below_root(port.path), tuple(commands))


def shown(recording: Recording, port: str | None) -> Points:
    """Return what the shown port sent: s, and the port's unit."""
    sent = _sent(recording, {port} if port is not None else ())
    return [(each.at / SECOND, each.value) for each in sent if isinstance(each.value, float)]


def commands(recording: Recording, ports: Collection[str]) -> dict[str, Points]:
    """Return a curve for each number that these ports sent, each held until the next."""
    short, curves = _short(list(ports)), dict[str, Points]()
    for each in _sent(recording, ports):
        for leaf, value in cells_of(plain(each.value), short[each.port]):
            if isinstance(value, int | float):  # a truth value is 0 or 1
                _hold(curves.setdefault(leaf, []), each.at / SECOND, float(value))
    return dict(islice(curves.items(), MOST_CURVES))


def _sent(recording: Recording, wanted: Collection[str]) -> Iterator[Sent]:
    """Yield what these ports sent, in order."""
    header = recording.header
    ports = ports_of(model_of(header, board_of(header)))
    for each_section in sections_between(recording, 0, NEVER):
        for each in values_in(each_section, header.ports, ports):
            if each.port in wanted:
                yield each


def _short(names: list[str]) -> Mapping[str, str]:
    """Names of ports without their components, where they are unique without."""
    ports = [name.rpartition(".")[2] for name in names]
    return dict(zip(names, ports if len(set(ports)) == len(ports) else names, strict=True))


def _hold(points: Points, at: float, value: float) -> None:
    if points and points[-1][1] != value:
        points.append((at, points[-1][1]))
    points.append((at, value))


def certificate_page(certificate: Certificate) -> Page:
    """The page of the certificate."""
    return Page(
        title=f"{certificate.plan.board.name}: each stage and its replay",
        opening=[_verdict(certificate), Text(text=_ABOUT)],
        parts=list(_sections(certificate)),
    )


def _sections(certificate: Certificate) -> Iterator[Section]:
    runs = [each for each in certificate.runs if each.has_run]
    yield section("Values that left the models", _events(certificate))
    differing = [(each, first) for each in runs if (first := each.first_difference) is not None]
    if differing:
        yield section("First differences", *(_difference(*each) for each in differing))
    yield from _side_by_side(runs, certificate)
    yield section("Code and settings", *_conditions(certificate))


def _verdict(certificate: Certificate) -> Verdict:
    stages = ", ".join(each.stage for each in certificate.runs if each.has_run) or "no stage"
    if certificate.is_identical:
        said = f"{CLAIM[0].upper()}{CLAIM[1:]}: {stages}."
        return Verdict(judgement="good", word=certificate.verdict, sentences=[said])
    said = f"Not shown that {CLAIM}: {stages}."
    return Verdict(judgement="bad", word=certificate.verdict, sentences=[said])


def _events(certificate: Certificate) -> Table:
    head = (
        "stage",
        "end",
        "how it ended",
        "own values",
        "compared",
        "differ",
        "age p50, p99 of what came in",
    )
    rows = (row for each in certificate.runs for row in _event_rows(each))
    return table("Each stage and its replay", head, rows, is_words=True)


def _event_rows(run: StageRun) -> Iterator[tuple[str, ...]]:
    if not run.has_run:
        yield (run.stage, "", f"not run: {run.why_not}", "", "", "", "")
        return
    if run.failed is not None or not run.ends:
        yield (run.stage, "", run.failed or "", "", "", "", "")
    for role, end in run.ends.items():
        ended = end.fault or run.document.get("ended", {}).get("reason", "")
        verdict = end.verdict
        counts = (verdict.values, verdict.compared, verdict.differences)
        yield (run.stage, role, ended, *(f"{count:,}" for count in counts), _age(run, role))


def _age(run: StageRun, role: str) -> str:
    link = run.document.get("link") or {}
    age = link.get("out" if role == ROBOT else "back", {}).get("age_us")
    return "" if age is None else f"{milliseconds(age['p50'])}, {milliseconds(age['p99'])}"


def _difference(run: StageRun, first: Difference) -> Table:
    said = first.as_json()
    values = {name: json.dumps(said[name]) for name in ("what", "recorded", "replayed")}
    return facts(f"{run.stage}, {first.where} at {format_time(first.at)}", values)


# The stages side by side ------------------------------------------------------------------------


def _side_by_side(runs: Sequence[StageRun], certificate: Certificate) -> Iterator[Section]:
    """A section for each quantity, a plot a stage in it: one axis of time, one of the quantity."""
    if not any(each.ends for each in runs):
        return
    signals = signals_of(certificate.plan.board)
    rows: dict[str, dict[str, Mapping[str, Points]]] = {
        signals.shown or "Shown value": {each.stage: _shown(each, signals) for each in runs},
        "Commands": {each.stage: _commands(each, signals) for each in runs},
    }
    for title, curves in rows.items():
        drawn = on_common_axes(
            {
                stage: plot
                for stage, each in curves.items()
                if (plot := _plot(stage, title, each, certificate.plan.for_s)) is not None
            }
        )
        shown: list[Part] = [drawn.get(each) or Text(text=f"{each}: none") for each in curves]
        yield section(title, Beside(parts=shown))


def _commands(run: StageRun, signals: Signals) -> Mapping[str, Points]:
    """Commands of the end that computes; none of a stage that left nothing."""
    for end in run.ends.values():
        return commands(end.recording, signals.commands)
    return {}


def _plot(stage: str, title: str, curves: Mapping[str, Points], for_s: float) -> Series | None:
    """Draw a quantity in a stage while its controller ran; None where there is nothing."""
    drawn = [
        curve(name, seen)
        for name, points in curves.items()
        if (seen := [point for point in points if point[0] <= for_s])
    ]
    return Series(stage, "s", title, drawn, is_small=True) if drawn else None


def _shown(run: StageRun, signals: Signals) -> dict[str, Points]:
    """The board's own value, from the end that has it, since the controller began."""
    for role, end in run.ends.items():
        since = run.controller_began_s if role == ROBOT else 0.0
        if points := shown(end.recording, signals.shown):
            later = [(at - since, value) for at, value in points if at >= since]
            return {signals.shown or "": later}
    return {}


def _conditions(certificate: Certificate) -> Iterator[Table]:
    said = certificate.as_json()
    settings: Mapping[str, object] = said["settings"]
    yield facts(
        "What ran",
        {
            "code the same in all runs and replays": said["same_code"],
            "SHA-256 of it": said["code_sha256"],
            "settings the same in all runs": said["same_settings"],
            "settings": settings["source"],
            "overrides": settings["overrides"],
            "SHA-256 of the settings": settings["sha256"],
            **(said["versions"] or {}),
        },
    )
    head = ("module", "SHA-256")
    yield table("SHA-256 of each module of its code", head, said["code"].items(), is_words=True)
