"""`run BOARD --stage network | remote`: both ends from one command, and a line on how they fare."""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping
from typing import Any, Final

from firmware_runtime.board.ends import ends_of
from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import ROBOT
from firmware_runtime.cli.own_terminal import OwnTerminal
from firmware_runtime.cli.planned_inputs import PlannedInput, inputs_after, inputs_refused
from firmware_runtime.cli.progress_line import Messages
from firmware_runtime.cli.readers_gone import OutputError, not_printed, print_line, readers_may_go
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.stages.staged_run import (
    Staged,
    StagedResult,
    StagedRun,
    leads_to,
    run_staged,
)
from firmware_runtime.lab.stages.way import WIFI
from firmware_runtime.links.cut.impaired_path import impairment
from firmware_runtime.links.key_file import read_key
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.statistics.number_formats import NOT_KNOWN, microseconds, milliseconds
from firmware_runtime.statistics.summary import outputs_text
from firmware_runtime.system.this_process import started_at

ROLES: Final = ("controller", "robot")


def run_both_ends(arguments: argparse.Namespace, board: Board) -> int:
    """Run the stage; print its one result."""
    staged = _staged(arguments, board)
    messages = Messages()
    line = _Line(messages, staged.for_s, wanted=not arguments.json)
    if not arguments.json:
        print_line(_opening(staged), sys.stdout)
    try:
        result = run_staged(staged, messages, line)
    finally:
        line.close()
    status = result.status
    try:
        with readers_may_go():
            _print(result, as_json=arguments.json)
    except OutputError as error:
        not_printed(error)
        status = status or Status.NOT_PRINTED
    return status


def _staged(arguments: argparse.Namespace, board: Board) -> Staged:
    """Raises ConfigError for an input that would never arrive, and a key that is none."""
    for_s = board.doubles_run_s if arguments.duration_s is None else arguments.duration_s
    staged = Staged(
        board=board,
        named=arguments.board,
        stage=arguments.stage,
        for_s=for_s,
        how=WIFI if arguments.impair is None else impairment(arguments.impair),
        peer=arguments.peer,
        key=arguments.key,
        is_over_ros=arguments.link == "ros2",
        inputs=[str(each) for each in arguments.inputs],
        trace=arguments.trace,
        record=arguments.record,
        called_at=started_at(),
    )
    if arguments.inputs and (faults := _astray(staged, arguments.inputs)):
        raise ConfigError(board.name, faults)
    if arguments.key is not None:
        read_key(arguments.key, "--key")
    return staged


def _astray(staged: Staged, inputs: list[PlannedInput]) -> list[str]:
    """A sentence for each input that neither end would take, said before one is started."""
    faults = inputs_after(seconds(staged.for_s), inputs)
    faults += inputs_refused(Ports(staged.board.unconnected().model), inputs)
    if staged.peer is not None and not faults:
        robot = ends_of(staged.board)[ROBOT]
        faults += [
            f"--input {each}: leads to the robot end, which runs elsewhere; expected it there"
            for each in inputs
            if leads_to(staged.board, str(each), robot)
        ]
    return faults


def _opening(staged: Staged) -> str:
    ends = "a robot end elsewhere" if staged.peer is not None else "the robot end on doubles"
    return (
        f"{staged.board.name}, stage {staged.stage}: its controller and {ends}, monotonic time, "
        f"for {staged.for_s:g} s; Ctrl-C stops it"
    )


class _Line:
    """Both ends on one line of the terminal, if there is one."""

    def __init__(self, messages: Messages, for_s: float, *, wanted: bool) -> None:
        self._messages = messages
        self._for_s = for_s
        self._terminal = OwnTerminal.of(sys.stdout) if wanted else None
        messages.terminal = self._terminal

    def __call__(self, run: StagedRun) -> None:
        """Write it over the last one."""
        if self._terminal is not None:
            self._terminal.show(stage_line(run.reports, self._for_s))

    def close(self) -> None:
        """Take the line away."""
        self._messages.terminal = None
        if self._terminal is not None:
            self._terminal.close()


def stage_line(reports: Mapping[str, Mapping[str, Any]], for_s: float) -> str:
    """Time, the shown value, arming, the link and what went wrong, of the controller and robot."""
    controller, robot = (reports.get(role, {}) for role in ROLES)
    if not (controller or robot):
        return "starting"
    at_s = controller.get("now_ns", 0) / SECOND
    words = [f"{at_s:.1f} of {for_s:g} s"]
    shown = robot if robot.get("value") is not None else controller
    if shown.get("value") is not None:
        words.append(f"{shown['shown'].rpartition('.')[2]} {shown['value']:.4g}")
    if robot:
        words.append("armed" if robot.get("armed") else "disarmed")
    link = _link(controller.get("link") or robot.get("link"))
    for name, word in (("overruns", "late"), ("faults", "faults")):
        counts = "+".join(str(each[name]) for each in (controller, robot) if name in each)
        words.append(f"{word} {counts}")
    return "  ".join([*words, link])


def _link(link: Mapping[str, Any] | None) -> str:
    if link is None:
        return "link not up"
    if link.get("why_bad") is not None:
        return f"link: {link['why_bad']}"
    return f"link good, age {milliseconds(link.get('age_us'))}"


def _print(result: StagedResult, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(result.document, allow_nan=False))
    else:
        print("\n".join(_text(result.document)))


def _text(document: Mapping[str, Any]) -> Iterator[str]:
    ended, link = document["ended"], document["link"]
    if ended["state"] in {"failed", "overrun"}:
        yield f"failed: {ended['by'] or 'the stage'}: {ended['reason']}"
    yield ""
    for name, value in (document["result"] or {}).items():
        yield f"{name} {value:.4f}" if isinstance(value, float) else f"{name} {value}"
    if "outputs_on" in document:
        yield outputs_text(document["outputs_on"])
    yield ""
    impaired = link["impairment"]
    how = f", {impaired['how']} by {impaired['by']}" if impaired is not None else ""
    yield f"link: {link['over']}, between {link['between']}{how}"
    yield from (_way_text(way, link[way]) for way in ("out", "back") if link[way])
    for role in ROLES:
        yield from end_text(role, document[role], ended["by"])


def _way_text(way: str, crossed: Mapping[str, Any]) -> str:
    """What went one way; what only the other end knows, and left no word of, is a dash."""
    refused = crossed.get("refused", {})
    reasons = ", ".join(f"{count} {reason}" for reason, count in refused.items() if count)
    age = crossed.get("age_us", {})
    names = ("sent", "received", "dropped", "overtaken")
    counts = [f"{name} {crossed.get(name, NOT_KNOWN)}" for name in names]
    if given_up := crossed.get("given_up"):
        counts.append(f"given up {given_up}")
    if unconnected := crossed.get("unconnected"):
        counts.append(f"left while not connected {unconnected}")
    return (
        f"  {way}: {', '.join(counts)}, refused {reasons or '0'}; "
        f"age p50 {microseconds(age.get('p50'))}, p99 {microseconds(age.get('p99'))}"
    )


def end_text(role: str, end: Mapping[str, Any] | None, by: str | None) -> Iterator[str]:
    """How an end ended, and what became of its activations; `by` is the end that ended first."""
    if end is None or "statistics" not in end:
        yield f"{role}: no statistics here"
        return
    statistics = end["statistics"]
    late = statistics["lateness_us"]
    is_asked = by not in {None, role} and end["ended"]["reason"] == "SIGTERM"
    reason = f"stopped, for the {by} had ended" if is_asked else end["ended"]["reason"]
    yield (
        f"{role}: {reason}; {statistics['run']} of {statistics['scheduled']} "
        f"activations run, {statistics['skipped']} skipped, {statistics['coalesced']} coalesced, "
        f"{statistics['overruns']} late; "
        f"lateness p50 {microseconds(late['p50'])}, p99 {microseconds(late['p99'])}"
    )
