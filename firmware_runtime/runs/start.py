"""The start of a run, stage by stage: each goes by what the stages before it have made.

    recording -> lines -> robot -> executive -> task -> links -> arming -> socket -> chips

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
from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.runs.arming import FREE, Arming, Permission, PrearmCheck
from firmware_runtime.runs.commanders import Commanders
from firmware_runtime.runs.dover import dover_blocks, dover_link
from firmware_runtime.runs.end_link import LinkedEnd, LinkedPart, check_end
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.last_safe_state import last_safe_state, safe_state_files
from firmware_runtime.runs.local_robot import RobotHere, robot_here
from firmware_runtime.runs.overload import watch_load
from firmware_runtime.runs.prearm_checks import prearm_checks
from firmware_runtime.runs.recorded_edge import RecordedEdge
from firmware_runtime.runs.run_interlock import RightToDrive
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.sleep_watch import watch_sleep
from firmware_runtime.runs.sockets import has_ports, serve
from firmware_runtime.runs.statistics_in_use import keep_clear_of_other_runs
from firmware_runtime.runs.switching_off import SwitchingOff
from firmware_runtime.runs.task import Task
from firmware_runtime.runs.tuning import Tuning, tuning_of
from firmware_runtime.system.scheduling import kept_off

if TYPE_CHECKING:
    from firmware_runtime.links.cut.address import OpenChannel
    from firmware_runtime.links.dover.blocks import DoverBlocks
    from firmware_runtime.links.dover.dover import DoverLink

Log: TypeAlias = Callable[[str], None]
"""Prints a sentence."""


def start_session(  # noqa: PLR0913 -- one path for the command and for programs
    board: Board,
    clock: Clock,
    *,
    doubles: bool | Path,
    statistics_path: Path | None,
    permission: Permission | None = None,
    end: BoardEnd | None = None,
    link: "OpenChannel | None" = None,
    recording: Path | None = None,
    log: Log = lambda _: None,
) -> Session:
    """Put a robot together for one run, and find its chips.

    `doubles` are made for the run (True), served at a path, or absent on the real robot (False).
    With a `permission` the run drives its outputs only while it is armed, see `arming`; without one
    always. With an `end` it runs that part of the model only, tied to the other by `link`; one
    without hardware opens no lines. What enters it is kept at `recording`, unless the board's
    `recording.minutes` are 0. `log` prints what happens, in sentences. Raises ConfigError for
    settings that do not fit the model, StatisticsFileError if another robot's run keeps its
    statistics at that path, and HalError when a bus or chip is missing; nothing was actuated then.
    A start that fails once chips are asked switches off what it can reach, releases the hardware,
    and only then leaves its recording.
    """
    check_end(end, link, clock)
    asked = _Asked(board, clock, doubles, statistics_path, end, link, log)
    with ExitStack() as undo:
        edge = _recording(asked, recording, undo)
        right = RightToDrive(unsupervised=permission is None)
        hardware = _lines(asked, right, edge, undo)
        replaced = None if statistics_path is None else keep_clear_of_other_runs(statistics_path)
        is_served = has_ports(statistics_path, clock)
        here = robot_here(board, hardware, end, edge, has_ports=is_served)
        if permission is None and hardware.is_here and here.timeouts:
            permission = FREE
        driven = _Driven(here.robot, hardware, SwitchingOff(board, hardware, edge, statistics_path))
        blocks = dover_blocks(here.robot.model, clock)
        executive = _executive(asked, driven, edge, is_armed=permission is None)
        task = Task(executive, here.robot)
        dover = _dover(asked, blocks, executive, undo)
        linked = _linked(asked, here, executive, task, right, undo=undo)
        silence = _commanders(asked, here, executive, right, linked)
        if permission is not None:
            commanded = [None if linked is None else linked.link.why_not, silence]
            right.arming = _arming(asked, driven, executive, permission, commanded)
        tuning = tuning_of(board, end, partial(_retune, here.robot, edge))
        _socket(asked, here, executive, right, tuning, undo=undo)
        edge.built(executive, here.robot, hardware, end)
        session = Session(
            board=board,
            end_of_board=end,
            edge=edge,
            hardware=hardware,
            switching_off=driven.switching_off,
            replaced=replaced,
            robot=here.robot,
            executive=executive,
            task=task,
            dover=dover,
            linked=linked,
            arming=right.arming,
            tuning=tuning,
            undo=ExitStack(),
        )
        watch_load(executive, board.settings.executive, session.supervision, log)
        _chips(session, log, undo)
        session.undo.push(undo.pop_all())  # nothing has failed: it is released by the session
    return session


class _Asked(Struct, frozen=True):
    """What a run is to be."""

    board: Board
    clock: Clock
    doubles: bool | Path
    statistics: Path | None
    end: BoardEnd | None
    link: "OpenChannel | None"
    log: Log


class _Driven(Struct, frozen=True):
    """A robot on its lines, and how it is switched off."""

    robot: Robot
    hardware: Hardware
    switching_off: SwitchingOff

    def make_safe(self) -> list[str]:
        """Switch all outputs off; return what failed."""
        return self.switching_off.all_of(self.robot)


def _recording(asked: _Asked, path: Path | None, undo: ExitStack) -> RecordedEdge:
    """What taps lines, clock and events. A start that fails is kept, once all else is released."""
    edge = RecordedEdge(asked.board, asked.clock, path, asked.log)

    def keep_failed(
        _type: type[BaseException] | None,
        error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        if error is not None:
            edge.keep_start(error)

    undo.push(keep_failed)
    undo.callback(edge.close)
    return edge


def _lines(asked: _Asked, interlock: RightToDrive, edge: RecordedEdge, undo: ExitStack) -> Hardware:
    is_here = asked.end is None or asked.end.has_hardware
    hardware = Hardware(
        asked.board,
        asked.clock,
        asked.doubles,
        interlock,
        is_here=is_here,
        recorder=edge.recorder,
    )
    undo.callback(hardware.close)
    return hardware


def _executive(asked: _Asked, driven: _Driven, edge: RecordedEdge, *, is_armed: bool) -> Executive:
    model, hardware, end = driven.robot.model, driven.hardware, asked.end
    elsewhere = () if end is None else end.elsewhere
    configuration = replace(
        configuration_of(asked.board, model, hardware.lines, elsewhere),
        statistics_path=asked.statistics,
        armed_at_start=is_armed and hardware.is_here,
        has_link=asked.link is not None,
        tap=edge.recorder,
        conditions=hardware.conditions(end),
    )
    return Executive(model, asked.clock, driven.make_safe, configuration, hardware.world_now)


def _dover(
    asked: _Asked, blocks: "DoverBlocks | None", executive: Executive, undo: ExitStack
) -> "DoverLink | None":
    """What the model's blocks of `models.dover` send and receive; None if it has none."""
    with kept_off(asked.board.settings.executive.cpus):
        link = dover_link(blocks, executive)
    if link is not None:
        undo.callback(link.close)
    return link


def _linked(  # noqa: PLR0913 -- a stage, of what those before it have made
    asked: _Asked,
    here: RobotHere,
    executive: Executive,
    task: Task,
    right: RightToDrive,
    *,
    undo: ExitStack,
) -> LinkedEnd | None:
    """The link to the other end, if there is one."""
    if asked.link is None or asked.end is None or here.part is None:
        return None
    part = LinkedPart(asked.board, asked.end, here.part, executive)
    linked = LinkedEnd(part, asked.link, task.end_with, right.suspend, asked.log)
    undo.callback(linked.close)
    return linked


def _commanders(
    asked: _Asked,
    here: RobotHere,
    executive: Executive,
    right: RightToDrive,
    linked: LinkedEnd | None,
) -> PrearmCheck | None:
    """What says that a command from outside comes no more; None where none can come."""
    if not here.timeouts:
        return None

    def fall_silent(why: str) -> None:
        if not right.suspend(why):
            asked.log(f"falls silent to the end with the outputs: {why}")

    commanders = Commanders(executive, here.timeouts, fall_silent)
    if linked is not None and asked.end is not None and not asked.end.has_hardware:
        linked.link.why_silent = commanders.why_silent
    return commanders.why_silent


def _arming(
    asked: _Asked,
    driven: _Driven,
    executive: Executive,
    permission: Permission,
    commanded: Sequence[PrearmCheck | None],
) -> Arming:
    """What decides whether outputs may be driven."""
    files = safe_state_files(asked.board.name, asked.statistics)
    arming = Arming(
        executive,
        permission,
        driven.make_safe,
        prearm_checks(executive, asked.board.settings.arming.max_late_percent),
        commanded=[check for check in commanded if check is not None],
        last_safe_state=partial(last_safe_state, files),
        enable=partial(driven.hardware.enable, enabled=True),
        log=asked.log,
    )
    watch_sleep(executive, arming)
    return arming


def _retune(robot: Robot, edge: RecordedEdge, settings: Any) -> None:  # noqa: ANN401 -- any board's
    """Let the robot take up settings, be it recorded or not."""
    robot.retune(settings)
    edge.retuned(settings)


def _socket(  # noqa: PLR0913 -- as `_linked`
    asked: _Asked,
    here: RobotHere,
    executive: Executive,
    right: RightToDrive,
    tuning: Tuning,
    *,
    undo: ExitStack,
) -> None:
    """Let other processes speak with the run, where they can find it."""
    where = asked.statistics, executive, here.ports
    served = serve(*where, arming=right.arming, tuning=tuning, log=asked.log)
    if served is not None:
        undo.callback(served.close)


def _chips(session: Session, log: Log, undo: ExitStack) -> None:
    """Ask every chip who it is; from here on something may have to be switched off."""

    def switch_off_unless_run() -> None:
        if not session.executive.has_begun:
            for fault in session.switching_off.before_a_run(session.robot):
                log(f"warning: not made safe: {fault}")

    undo.callback(switch_off_unless_run)
    with session.edge.section(Kind.PROBE):
        session.robot.find_chips()
    session.edge.open()
    if session.arming is None:
        session.hardware.enable(enabled=True)
