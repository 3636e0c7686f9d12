"""A stage, from the start of its one process or its two ends to their one result."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic_ns
from typing import Any, Final

from firmware_runtime.board.assignments import set_words
from firmware_runtime.board.ends import ends_of
from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import CONTROLLER, ROBOT, Stage, components_of
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, Status
from firmware_runtime.lab.stages.document import (
    begin_trace,
    crossed,
    merge_traces,
    of_an_end,
    of_two_ends,
)
from firmware_runtime.lab.stages.two_ends import EndProcess, TwoEnds
from firmware_runtime.lab.stages.way import WIFI, Way, bad_network, loopback, ros_graph, to_peer
from firmware_runtime.links.cut.impaired_path import Impairment
from firmware_runtime.system.own_folder import own_folder
from firmware_runtime.system.signals import UntilSignal, status_by, until_signal
from firmware_runtime.system.this_process import kept_off
from firmware_runtime.system.this_system import demand_linux

UNTIL_STOPPED_S: Final = 1e9
_AT_LEAST_S: Final = 120.0
_TIMES: Final = 10.0
"""A run of one process that takes so many times its robot time, and at least so long, hangs."""
Say = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Staged:
    """Settings of a stage, or of several one after the other, each with its own in place.

    `named` is the board as the command line has it.
    """

    board: Board
    named: str
    stage: Stage = Stage.SIMULATION
    for_s: float = 0.0
    how: Impairment = WIFI
    """Stage remote's network, each way."""
    peer: str | None = None
    key: Path | None = None
    is_over_ros: bool = False
    """True if stage network goes over ROS 2 instead of UDP."""
    inputs: Sequence[str] = ()
    trace: Path | None = None
    record: Path | None = None
    """File of the controller's recording; the robot end's, if it is here, is beside it."""
    loop_s: float | None = None
    """The period of a loop that is run in place of the board's model, to measure its delay."""
    called_at: int = field(default_factory=monotonic_ns)
    """Instant of the call, ns of CLOCK_MONOTONIC: a `safe-state` that came later is for
    ends that start after it, too."""

    @property
    def way(self) -> Callable[[Say], AbstractContextManager[Way]]:
        """Link between the ends."""
        if self.peer is not None and self.key is not None:
            peer, key = self.peer, self.key
            return lambda _say: to_peer(peer, key)
        if self.stage is Stage.NETWORK:
            return lambda _say: ros_graph() if self.is_over_ros else loopback()
        return lambda say: bad_network(self.how, say)


@dataclass(slots=True)
class StagedRun:
    """Both ends while they run; `reports` are the newest of each, by role."""

    staged: Staged
    way: Way
    ends: TwoEnds
    folder: Path
    roles: Mapping[str, str]
    """Names of the two ends on this board."""
    by_role: dict[str, EndProcess] = field(default_factory=dict)

    @property
    def reports(self) -> Mapping[str, Mapping[str, Any]]:
        """Newest report of each end."""
        return {role: end.report for role, end in self.by_role.items()}

    def run(self) -> None:
        """Start the robot end, then the controller, and watch them until both have ended."""
        timeout = seconds(self.staged.board.settings.executive.bring_up_s)
        if self.staged.peer is None:
            robot = self._start(ROBOT, self.way.robot_link, self.way.before_robot)
            is_there = self.ends.wait_until(lambda: bool(robot.report), timeout)
            if not is_there and not self.ends.is_ending:
                raise ConfigError("robot end", [f"not running within {timeout // SECOND} s"])
        if not self.ends.is_ending:
            self._start(CONTROLLER, self.way.controller_link, self.way.before_controller)
        self.ends.wait_until(lambda: False)

    def trace_of(self, role: str) -> Path:
        """Return the file of an end's own trace."""
        return self.folder / f"{role}.jsonl"

    def _start(self, role: str, link: str, before: Sequence[str]) -> EndProcess:
        staged = self.staged
        words = ["run", staged.named, "--role", self.roles[role], "--link", link]
        words += set_words(staged.board.assignments)
        is_robot = role == ROBOT
        words += ["--called-at", str(staged.called_at)]
        words += ["--for", f"{UNTIL_STOPPED_S if is_robot else staged.for_s:g}"]
        words += ["--doubles"] if is_robot and staged.loop_s is None else []
        for planned in staged.inputs:
            if (role == ROBOT) == leads_to(staged.board, planned, self.roles[ROBOT]):
                words += ["--input", planned]
        if staged.loop_s is not None:
            words += [
                "--loop",
                f"{staged.loop_s:g}",
                "--statistics",
                str(self.folder / f"{role}.stats"),
            ]
        if staged.trace is not None:
            words += ["--trace", str(self.trace_of(role))]
        if staged.record is not None:
            kept = staged.record if role == CONTROLLER else beside(staged.record)
            words += ["--record", str(kept.absolute())]
        self.by_role[role] = end = EndProcess(role, words, before)
        self.ends.add(end)
        return end


@dataclass(frozen=True, slots=True)
class StagedResult:
    """Result of a stage: its exit status, its document, and the port that was shown."""

    status: int
    document: dict[str, Any]
    shown: str | None

    @property
    def reason(self) -> str:
        """Reason of its end, in words, with the end that it was of."""
        ended = self.document.get("ended", {"reason": f"status {self.status}"})
        return f"{ended['by']}: {ended['reason']}" if ended.get("by") else str(ended["reason"])


def run_one_process(staged: Staged, say: Say, picture: Path | None = None) -> StagedResult:
    """Run a stage of one process on doubles to its end, with a picture of it if one is wanted.

    Raises FirmwareRuntimeError for one that does not end.
    """
    words = ["run", staged.named, "--stage", staged.stage.value, "--for", f"{staged.for_s:g}"]
    words += ["--doubles", *set_words(staged.board.assignments)]
    files = {"--trace": staged.trace, "--record": staged.record, "--plot": picture}
    for option, path in files.items():
        words += [] if path is None else [option, str(path)]
    for planned in staged.inputs:
        words += ["--input", planned]
    with until_signal() as signalled:
        ends = TwoEnds(signalled, say, lambda: None)
        try:
            ends.add(end := EndProcess(staged.stage.value, words))
            timeout_s = max(_AT_LEAST_S, _TIMES * staged.for_s)
            ends.wait_until(lambda: bool(ends.ended), seconds(timeout_s))
            if end.status is None:
                fault, where = f"no end within {timeout_s:g} s", f"stage {staged.stage}"
                raise FirmwareRuntimeError(fault, where=where)
            status = status_by(signalled.name) if signalled.came else end.status
            return StagedResult(status, end.document(), end.report.get("shown"))
        finally:
            ends.end()
            ends.close()


def run_to_end(staged: Staged, say: Say, picture: Path | None = None) -> StagedResult:
    """Run a stage to its end, in one process or two. Raises SystemExit for a signal."""
    if staged.stage.has_two_ends:
        result = run_staged(staged, say, lambda _: None)
    else:
        result = run_one_process(staged, say, picture)
    if result.status in {Status.INTERRUPTED, Status.TERMINATED}:
        raise SystemExit(result.status)
    return result


def run_staged(staged: Staged, say: Say, show: Callable[[StagedRun], None]) -> StagedResult:
    """Run a stage of two ends to its end; nothing of it is left running. Raises ConfigError."""
    demand_linux("a stage of two ends")
    roles = (
        {each: each for each in (ROBOT, CONTROLLER)}
        if staged.loop_s is not None
        else ends_of(staged.board)
    )
    if staged.trace is not None:
        begin_trace(staged.trace)
    with ExitStack() as stack:
        signalled = stack.enter_context(until_signal())
        folder = stack.enter_context(own_folder())
        with kept_off(staged.board.settings.executive.cpus):
            way = stack.enter_context(staged.way(say))
        ends = TwoEnds(signalled, say, lambda: show(run))
        stack.callback(ends.close)
        run = StagedRun(staged, way, ends, folder, roles)
        try:
            run.run()
        finally:
            ends.end()
        return _result(run, signalled)


@contextmanager
def own_state() -> Iterator[None]:
    """Within the block runs have sockets and statistics of their own: the robot may be running."""
    key = "FIRMWARE_RUNTIME_STATE_DIRECTORY"
    before = os.environ.get(key)
    with own_folder() as folder:
        os.environ[key] = str(folder)
        try:
            yield
        finally:
            os.environ.pop(key)
            if before is not None:
                os.environ[key] = before


def beside(record: Path) -> Path:
    """Return where the robot end's recording is kept, beside the controller's."""
    return record.with_name(f"{record.name}.robot")


def leads_to(board: Board, planned: str, role: str) -> bool:
    """Return whether an input of the top model leads to a component of this role."""
    name = planned.partition(":")[2].partition("=")[0]
    model = board.unconnected().model
    own = set(components_of(board.settings.roles, model, role))
    return any(end.owner.name in own for begin, end in model.couplings if begin.name == name)


def _result(run: StagedRun, signalled: UntilSignal) -> StagedResult:
    staged, ends = run.staged, run.ends
    counted = run.way.finish()
    documents = {role: end.document() for role, end in run.by_role.items()}
    began = {
        role: report["began_ns"] for role, report in run.reports.items() if "began_ns" in report
    }
    if staged.trace is not None:
        merge_traces({role: run.trace_of(role) for role in run.by_role}, began, staged.trace)
    failed = ends.failed_first
    status: int = status_by(signalled.name) if signalled.came else Status.OK
    if failed is not None:
        status = failed.status or Status.MODEL_ERROR
    controller, robot = (
        of_an_end(documents[role], run.by_role[role].status) if role in documents else None
        for role in (CONTROLLER, ROBOT)
    )
    merged = of_two_ends(controller or {}, robot, began)
    link = {**run.way.conditions, **crossed(controller, robot)}
    if counted:
        link["datagrams"] = counted
    return StagedResult(
        status,
        {
            "board": staged.board.name,
            "stage": staged.stage.value,
            "clock": "monotonic",
            "ended": _how(ends, documents, signalled),
            **merged,
            "link": link,
        },
        next((name for each in run.reports.values() if (name := each.get("shown"))), None),
    )


def _how(
    ends: TwoEnds, documents: Mapping[str, Mapping[str, Any]], signalled: UntilSignal
) -> dict[str, Any]:
    """Say how it ended: by the end that failed first, whose time was up, or that ended first."""
    failed = ends.failed_first
    if failed is None and signalled.came:
        return {"state": "stopped", "reason": signalled.name, "by": None}
    states = {role: each.get("ended", {}).get("state") for role, each in documents.items()}
    in_time = (end for end in ends.ended if states[end.role] == "ended")
    first = failed or next(in_time, ends.ended[0] if ends.ended else None)
    if first is None:
        return {"state": "failed", "reason": "no end was started", "by": None}
    ended = documents[first.role].get("ended")
    if ended is None:
        ended = {"state": "failed", "reason": f"ended with status {first.status}"}
    return {**ended, "by": first.role}
