"""The start of a run, stage by stage: each is a function of what the stages before it returned.

    recording -> lines -> robot -> executive -> links -> arming -> socket -> chips

What a stage opens is released when the run is over, or when a later stage fails: the last first.
Nothing is actuated before the last one; it asks the chips, and what they may then drive is switched
off before anything is released.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.board.configuration import configuration_of
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.runs.arming import FREE, Arming, Permission, PrearmCheck, prearm_checks
from firmware_runtime.runs.hardware import Hardware, refuse_faults
from firmware_runtime.runs.local_robot import LocalRobot, local_robot
from firmware_runtime.runs.recorded_edge import RecordedEdge
from firmware_runtime.runs.session import Session, Task
from firmware_runtime.runs.supervision import (
    Commanders,
    DeviceMessages,
    RightToDrive,
    watch_load,
    watch_sleep,
)
from firmware_runtime.runs.tuning import Tuning, tuning_of
from firmware_runtime.runs.watched_run import (
    keep_clear_of_other_runs,
    last_safe_state,
    safe_state_files,
)
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.system.this_system import IS_LINUX

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd
    from firmware_runtime.hal.strike import Strike
    from firmware_runtime.links.cut.address import OpenChannel
    from firmware_runtime.links.dover.dover import DoverBlocks
    from firmware_runtime.runs.end_link import LinkedEnd

Log: TypeAlias = Callable[[str], None]
"""Prints a sentence."""


def way_of(stated: str | None) -> "OpenChannel | None":
    """Return what opens the way to the other end, if one is stated. Raises ConfigError."""
    if stated is None:
        return None
    # a run without a link starts without all that one takes
    from firmware_runtime.links.cut.address import link_address  # noqa: PLC0415

    return link_address(stated)


class _Start(Struct, frozen=True):
    """Choices for a run, and what is to be undone at its end or when a stage fails."""

    board: Board
    clock: Clock
    doubles: bool | Path
    statistics: Path | None
    end: "BoardEnd | None"
    link: "OpenChannel | None"
    log: Log
    undo: ExitStack


def start_session(  # noqa: PLR0913 -- one path for the command and for programs
    board: Board,
    clock: Clock,
    *,
    doubles: bool | Path,
    statistics_path: Path | None,
    permission: Permission | None = None,
    end: "BoardEnd | None" = None,
    link: "OpenChannel | None" = None,
    recording: Path | None = None,
    faults: "Sequence[Strike]" = (),
    log: Log = lambda _: None,
) -> Session:
    """Put a robot together for one run, and find its chips.

    `doubles` are made for the run (True), served at a path, or absent on the real robot (False).
    With a `permission` the run drives its outputs only while it is armed, see `arming`; without one
    always. With an `end` it runs that part of the model only, tied to the other by `link`; one
    without hardware opens no lines. What enters it is kept at `recording`, unless the board's
    `recording.minutes` are 0. `faults` are made on doubles of this run, each at its instant. `log`
    prints what happens, in sentences. Raises ConfigError for settings that do not fit the model,
    and faults that cannot be made, StatisticsFileError if another robot's run keeps its statistics
    at that path, and HalError when a bus or chip is missing; nothing was actuated then.
    A start that fails once chips are asked switches off what it can reach, releases the hardware,
    and only then leaves its recording.
    """
    _check_end(end, link, clock)
    with ExitStack() as undo:
        start = _Start(board, clock, doubles, statistics_path, end, link, log, undo)
        edge = _recording(start, recording)
        right = RightToDrive(unsupervised=permission is None)
        hardware = _lines(start, right, edge, faults)
        replaced = None if statistics_path is None else keep_clear_of_other_runs(statistics_path)
        local = _robot(start, hardware, edge)
        if permission is None and hardware.is_here and local.timeouts:
            permission = FREE
        speak = _dover_blocks(local.robot, clock)
        executive = _executive(start, local, edge, is_armed=permission is None)
        task = Task(executive, local.robot)
        _dover(start, executive, speak)
        linked = _linked(start, local, executive, task, right)
        silence = _commanders(start, local, executive, right, linked)
        if permission is not None:
            commanded = [each for each in (linked and linked.link.why_not, silence) if each]
            right.arming = _arming(start, local, executive, permission, commanded)
        tuning = tuning_of(board, end, partial(_retune, local.robot, edge))
        of_script = partial(_arming_of_script, start, local, executive, right)
        hardware.command(executive, of_script, tuning)
        _socket(start, local, executive, right.arming, tuning)
        edge.built(executive, local.robot, hardware, end)
        watch_load(executive, board.settings.executive, right.supervision, log)
        DeviceMessages(executive, log)
        _chips(start, local, executive, edge, is_armed=permission is None)
        return Session(
            board=board,
            end_of_board=end,
            edge=edge,
            hardware=hardware,
            switching_off=local.switching_off,
            replaced=replaced,
            robot=local.robot,
            executive=executive,
            task=task,
            linked=linked,
            right=right,
            tuning=tuning,
            undo=undo.pop_all(),
        )


def _check_end(end: "BoardEnd | None", link: "OpenChannel | None", clock: Clock) -> None:
    """Refuse an end that cannot be run. Raises ConfigError."""
    if end is not None or link is not None:
        from firmware_runtime.runs.end_link import check_end  # noqa: PLC0415 -- as `way_of`

        check_end(end, link, clock)


def _recording(start: _Start, path: Path | None) -> RecordedEdge:
    """Tap lines, clock and events. A start that fails is kept, once all else is released."""
    edge = RecordedEdge(start.board, start.clock, path, start.log)

    def keep_failed(
        _type: type[BaseException] | None,
        error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        if error is not None:
            edge.keep_start(error)

    start.undo.push(keep_failed)
    start.undo.callback(edge.close)
    return edge


def _lines(
    start: _Start, interlock: RightToDrive, edge: RecordedEdge, faults: "Sequence[Strike]"
) -> Hardware:
    """Open the lines, or those of doubles; absent ones at an end without hardware."""
    is_here = start.end is None or start.end.has_hardware
    if faults and not (is_here and start.doubles is True):
        refuse_faults(start.board.name, start.doubles)
    board, clock, doubles = start.board, start.clock, start.doubles
    hardware = Hardware(board, clock, doubles, interlock, is_here=is_here, recorder=edge.recorder)
    start.undo.callback(hardware.close)
    hardware.strike(faults)
    return hardware


def _robot(start: _Start, hardware: Hardware, edge: RecordedEdge) -> LocalRobot:
    """Build the robot; it has ports for others in real time, where they can find the run."""
    has_ports = start.statistics is not None and isinstance(start.clock, MonotonicClock)
    where = start.end, edge, start.statistics
    return local_robot(start.board, hardware, *where, has_ports=has_ports)


def _dover_blocks(robot: Robot, clock: Clock) -> "DoverBlocks | None":
    """Find the model's blocks of `models.dover`, before it is on an executive; few have any."""
    if not any(getattr(each, "has_dover_link", False) for each in with_all_below(robot.model)):
        return None
    from firmware_runtime.links.dover.dover import DoverBlocks  # noqa: PLC0415

    return DoverBlocks(robot.model, clock)


def _executive(
    start: _Start, local: LocalRobot, edge: RecordedEdge, *, is_armed: bool
) -> Executive:
    """Put the model into a loop; `is_armed`: nothing decides whether it may drive."""
    model, hardware, end = local.robot.model, local.hardware, start.end
    elsewhere = () if end is None else end.elsewhere
    configuration = replace(
        configuration_of(start.board, model, hardware.lines, elsewhere),
        statistics_path=start.statistics,
        armed_at_start=is_armed and hardware.is_here,
        has_link=start.link is not None,
        tap=edge.recorder,
        conditions=hardware.conditions(end),
    )
    executive = Executive(model, start.clock, local.make_safe, configuration, hardware.world_now)
    start.undo.callback(executive.inbox.close)
    return executive


def _dover(start: _Start, executive: Executive, blocks: "DoverBlocks | None") -> None:
    """Open the ports of the model's blocks of `models.dover`, if it has any."""
    if not blocks:
        return
    from firmware_runtime.links.dover.dover import DoverLink  # noqa: PLC0415 -- few runs have any

    start.undo.callback(DoverLink(blocks, executive).close)


def _linked(
    start: _Start, local: LocalRobot, executive: Executive, task: Task, right: RightToDrive
) -> "LinkedEnd | None":
    """Open the link to the other end, if there is one."""
    if start.link is None or start.end is None or local.part is None:
        return None
    from firmware_runtime.runs.end_link import LinkedEnd, open_link  # noqa: PLC0415 -- as `way_of`

    board, end, log = start.board, start.end, start.log
    link = open_link(board, end, local.part, executive, start.link, log=log)
    start.undo.callback(link.close)

    def turn_off(why: str) -> None:
        if not right.suspend(why):
            log(f"link: {why}")

    return LinkedEnd(link, executive, task.end_with, turn_off, ends_both=end.has_hardware)


def _commanders(
    start: _Start,
    local: LocalRobot,
    executive: Executive,
    right: RightToDrive,
    linked: "LinkedEnd | None",
) -> PrearmCheck | None:
    """Watch the input ports whose silence is noticed; None where there are none."""
    if not local.timeouts:
        return None

    def fall_silent(why: str) -> None:
        if not right.suspend(why):
            start.log(f"falls silent to the end with the outputs: {why}")

    commanders = Commanders(executive, local.timeouts, fall_silent)
    if linked is not None and not local.hardware.is_here:
        linked.link.why_silent = commanders.why_silent
    return commanders.why_silent


def _arming(
    start: _Start,
    local: LocalRobot,
    executive: Executive,
    permission: Permission,
    commanded: Sequence[PrearmCheck],
) -> Arming:
    """Decide from now on whether outputs may be driven."""
    files = safe_state_files(start.board.name, start.statistics)
    arming = Arming(
        executive,
        permission,
        local.make_safe,
        prearm_checks(executive, start.board.settings.arming.max_late_percent),
        commanded=commanded,
        last_safe_state=partial(last_safe_state, files),
        enable=partial(local.hardware.enable, enabled=True),
        log=start.log,
    )
    watch_sleep(executive, arming)
    return arming


def _arming_of_script(
    start: _Start, local: LocalRobot, executive: Executive, right: RightToDrive
) -> Arming:
    """Return the run's arming; one on its own doubles gets it here, once a script may disarm it."""
    if right.arming is None:
        right.arming = _arming(start, local, executive, FREE, ())
    return right.arming


def _retune(robot: Robot, edge: RecordedEdge, settings: Any) -> None:  # noqa: ANN401 -- any board's
    """Let the robot take up settings, be it recorded or not."""
    robot.retune(settings)
    edge.retuned(settings)


def _socket(
    start: _Start, local: LocalRobot, executive: Executive, arming: Arming | None, tuning: Tuning
) -> None:
    """Let other processes speak with the run, where they can find it; on Linux only."""
    if start.statistics is None or not IS_LINUX:
        return
    # a run that keeps no statistics starts without all that this takes
    from firmware_runtime.runs.requests import Requests  # noqa: PLC0415

    path = Companion.SOCKET.beside(start.statistics)
    requests = Requests(path, executive, local.ports, arming=arming, tuning=tuning, log=start.log)
    start.undo.callback(requests.close)


def _chips(
    start: _Start, local: LocalRobot, executive: Executive, edge: RecordedEdge, *, is_armed: bool
) -> None:
    """Ask every chip who it is; from here on something may have to be switched off."""

    def switch_off_unless_run() -> None:
        if not executive.has_begun:
            for fault in local.switching_off.before_a_run(local.robot):
                start.log(f"warning: not made safe: {fault}")

    start.undo.callback(switch_off_unless_run)
    with edge.section(Kind.PROBE):
        local.robot.find_chips()
    edge.open()
    if is_armed:
        local.hardware.enable(enabled=True)
