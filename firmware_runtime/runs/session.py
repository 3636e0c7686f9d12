"""One robot put together for one run: board, buses or rig, model, executive."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from msgspec.structs import replace

from firmware_runtime.blackbox.section import Kind
from firmware_runtime.board.ending import Ending
from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.runs.arming import FREE, Arming, Permission, PrearmCheck
from firmware_runtime.runs.board_configuration import configuration_of
from firmware_runtime.runs.commanders import Commanders
from firmware_runtime.runs.dover import dover_blocks, dover_link
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.kept_by_run import keep_clear_of_other_runs
from firmware_runtime.runs.last_safe_state import last_safe_state, safe_state_files
from firmware_runtime.runs.linking import LinkedEnd, LinkedPart, check_end
from firmware_runtime.runs.overload import watch_load
from firmware_runtime.runs.prearm_checks import prearm_checks
from firmware_runtime.runs.quitting import quitting_is_a_bug
from firmware_runtime.runs.recorded_edge import RecordedEdge
from firmware_runtime.runs.rigs import shown_by
from firmware_runtime.runs.robot_here import robot_here
from firmware_runtime.runs.sleep_watch import watch_sleep
from firmware_runtime.runs.sockets import has_ports, serve
from firmware_runtime.runs.switching_off import SwitchingOff
from firmware_runtime.runs.tuning import tuning_of
from firmware_runtime.system.other_processors import kept_off

if TYPE_CHECKING:
    from firmware_runtime.links.cut.address import OpenChannel


class Held(Protocol):
    """Something of a run that is open until it is over."""

    def close(self) -> None:
        """Release it."""


class Session:
    """A robot whose chips have answered, ready to run.

    `doubles` are made for the run (True), served at a path, or absent on the real robot (False);
    `rig` is there only if they were made. With a `permission` the run drives its outputs only while
    it is armed, see `arming`; without one always. With an `end` it runs that part of the model
    only, tied to the other by `link`; one without hardware opens no lines. What enters it is kept
    at `recording`, unless the board's `recording.minutes` are 0. `log` prints what happens, in
    sentences. Raises ConfigError for settings that do not fit the model,
    StatisticsFileError if another robot's run keeps its statistics at that path, and HalError when
    a bus or chip is missing; nothing was actuated then. A start that fails once chips are asked
    switches off what it can reach, releases the hardware, and only then leaves its recording.
    """

    def __init__(  # noqa: PLR0913 -- one path for the command and for programs
        self,
        board: Board,
        clock: Clock,
        *,
        doubles: bool | Path,
        statistics_path: Path | None,
        permission: Permission | None = None,
        end: BoardEnd | None = None,
        link: "OpenChannel | None" = None,
        recording: Path | None = None,
        log: Callable[[str], None] = lambda _: None,
    ) -> None:
        check_end(end, link, clock)
        self.board = board
        self.end_of_board = end
        self._statistics_path = statistics_path
        self._held: list[Held] = []
        self._log = log
        self._edge = RecordedEdge(board, clock, recording, log)
        self.recorder = recorder = self._edge.recorder
        self.has_hardware = is_here = end is None or end.has_hardware
        self._is_unsupervised = permission is None
        self.arming: Arming | None = None
        self.hardware = Hardware(
            board, clock, doubles, self._may_drive, is_here=is_here, recorder=recorder
        )
        self.world_now = self.hardware.world_now
        self._off = SwitchingOff(board, self.hardware, self._edge, statistics_path)
        with ExitStack() as undo:
            undo.push(self._broken_off)
            self.replaced = statistics_path and keep_clear_of_other_runs(statistics_path)
            """What is wrong with the file that this run's statistics replace, if it is damaged."""
            is_served = has_ports(statistics_path, clock)
            here = robot_here(board, self.hardware, end, self._edge, has_ports=is_served)
            self.robot, self.part = here.robot, here.part
            if permission is None and is_here and here.timeouts:
                permission = FREE
            blocks = dover_blocks(self.robot.model, clock)
            is_armed = permission is None and is_here
            self.executive = self._executive(clock, is_armed=is_armed, has_link=link is not None)
            with kept_off(board.settings.executive.cpus):
                self.dover = dover_link(blocks, self.executive)
            """What the model's blocks of `models.dover` send and receive; None if it has none."""
            self._hold(self.dover)
            self.ending: Ending | None = None
            self.linked = None if link is None else self._linked(link)
            commanders = self._commanders(here.timeouts)
            if permission is not None:
                self.arming = self._arming(permission, commanders)
            self.tuning = tuning_of(board, end, self._retune)
            where = statistics_path, self.executive, here.ports
            self._hold(serve(*where, arming=self.arming, tuning=self.tuning, log=log))
            self._edge.built(self.executive, self.robot, self.hardware, end)
            watch_load(self.executive, board.settings.executive, self.supervision, log)
            self._off.asks_chips = True
            with self._edge.section(Kind.PROBE):
                self.robot.find_chips()
            self._edge.open()
            if permission is None:
                self.hardware.enable(enabled=True)
            undo.pop_all()

    @property
    def rig(self) -> Rig | None:
        """The doubles that were made for this run, and their world."""
        return self.hardware.rig

    @property
    def recording(self) -> Path | None:
        """Where the recording of the run is, once that has begun; None where it is not recorded."""
        return self._edge.kept

    @property
    def is_outside(self) -> bool:
        """Whether its outputs are outside of this process, on chips or on doubles that are served.

        They stay as they are while nothing runs here, and others can switch them off.
        """
        return self.hardware.is_outside

    @property
    def supervision(self) -> Arming | None:
        """What lets a run drive that may not drive of itself; None for any other."""
        return None if self.arming is None or self.arming.is_free else self.arming

    @property
    def shown(self) -> OutPort[float] | None:
        """The port whose values a person wants to see over time, if there is one."""
        return self.robot.shown if self.rig is None else shown_by(self.rig, self.board)

    @property
    def has_failed(self) -> bool:
        """Whether the robot itself ended the run because something went wrong."""
        return self.ending is not None and self.ending.failed

    def run(self, until: int) -> Outcome:
        """Run up to and including instant `until`; outputs are off when it returns.

        Raises ModelError for a model that would have ended the program without a word.
        """
        self._off.leave_word()
        try:
            with quitting_is_a_bug(self.robot.model):
                return self._parted(self.executive.run(until))
        finally:
            self._off.leave_no_word()

    def run_on(self, until: int) -> Outcome:
        """Run to instant `until` and pause there; again, go on to a later one.

        Outputs outside of this process are off in a pause, and the run is armed again when it goes
        on; if they cannot be switched off, the run ends. In a world within this process nothing
        passes, so nothing has to be off.
        """
        if self.executive.reached == 0:
            self._off.leave_word()
        try:
            outcome = self.executive.run_on(until)
        finally:
            if self.executive.is_over:
                self._off.leave_no_word()
        if self.executive.is_over:
            return self._parted(outcome)
        if self.arming is not None and self.is_outside and self.arming.pause():
            return self.end() or outcome
        return outcome

    def end(self) -> Outcome | None:
        """End a paused run with all outputs off; None if it never began or is over."""
        outcome = self.executive.end()
        if outcome is not None:
            self._off.leave_no_word()
            self._parted(outcome)
        return outcome

    def result(self) -> dict[str, object]:
        """How the run ended: the world's truth on doubles, else what the robot itself knows."""
        return self.hardware.result(self.robot.own_result())

    def outputs(self) -> dict[str, int] | None:
        """How many outputs of each chip are on; None where that is unknown."""
        return self.hardware.outputs()

    def make_safe(self) -> list[str]:
        """Disable all outputs at once where a line can, then write full-off to every chip.

        Returns what failed, one sentence each.
        """
        return self._off.all_of(self.robot)

    def close(self) -> None:
        """Release buses, sockets and doubles that are served, with outputs off.

        What has run has switched off at its end; what has not does so here, and logs what fails.
        """
        try:
            if self._off.asks_chips and not self.executive.has_begun:
                for fault in self._off.before_a_run(self.robot):
                    self._log(f"warning: not made safe: {fault}")
        finally:
            self.hardware.close()
        for held in self._held:
            held.close()
        self._edge.close()

    # ---------------------------------------------------------------------------------------------

    @property
    def recorded_in(self) -> str | None:
        """Where the recording of this run is; None if there is none."""
        return self._edge.said

    def _broken_off(self, _type: object, error: BaseException | None, _traceback: object) -> None:
        """Let go of a start that failed; it is recorded once nothing can be on."""
        has_asked = self._off.asks_chips
        try:
            self.close()
        finally:
            if has_asked and error is not None:
                self._edge.keep_start(error)

    def _parted(self, outcome: Outcome) -> Outcome:
        """The run is over: the other end learns of it, and why."""
        if self.linked is not None:
            self.linked.say_goodbye(outcome, self.ending)
        return outcome

    def _hold(self, held: Held | None) -> None:
        """Release it when the run is over; for nothing there is nothing to do."""
        if held is not None:
            self._held.append(held)

    def _executive(self, clock: Clock, *, is_armed: bool, has_link: bool) -> Executive:
        model, end = self.robot.model, self.end_of_board
        elsewhere = () if end is None else end.elsewhere
        configuration = replace(
            configuration_of(self.board, model, self.hardware.lines, elsewhere),
            statistics_path=self._statistics_path,
            armed_at_start=is_armed,
            has_link=has_link,
            tap=self.recorder,
            conditions=self.hardware.conditions(end),
        )
        executive = Executive(model, clock, self.make_safe, configuration, self.world_now)
        if self.robot.ended is not None:
            executive.simulator.listen(self.robot.ended, self._end)
        return executive

    def _linked(self, open_channel: "OpenChannel") -> LinkedEnd:
        """The link to the other end."""
        assert self.end_of_board is not None  # noqa: S101 -- `check_end` has refused it
        assert self.part is not None  # noqa: S101 -- likewise
        part = LinkedPart(self.board, self.end_of_board, self.part, self.executive)
        linked = LinkedEnd(part, open_channel, self._end_with, self._log)
        self._hold(linked)
        return linked

    def _may_drive(self) -> bool:
        """Output interlock: a run that needs no permission may, any other as its arming says."""
        arming = self.arming
        return self._is_unsupervised if arming is None else arming.interlock()

    def _commanders(self, timeouts: Mapping[InPort[Any], int]) -> Commanders | None:
        """What notices that a command from outside comes no more; None where none can come."""
        if not timeouts:
            return None
        found = Commanders(self.executive, timeouts, self._suspend)
        if self.linked is not None and not self.has_hardware:
            self.linked.link.why_silent = found.why_silent
        return found

    def _suspend(self, why: str) -> None:
        """Have the outputs off for a while."""
        if self.arming is None:
            self._log(f"falls silent to the end with the outputs: {why}")
        else:
            self.arming.suspend(why)

    def _arming(self, permission: Permission, commanders: Commanders | None) -> Arming:
        """What decides whether outputs may be driven."""
        files = safe_state_files(self.board.name, self._statistics_path)
        commanded: list[PrearmCheck] = []
        if self.linked is not None:
            commanded.append(self.linked.link.why_not)
        if commanders is not None:
            commanded.append(commanders.why_silent)
        max_late_percent = self.board.settings.arming.max_late_percent
        arming = Arming(
            self.executive,
            permission,
            self.make_safe,
            prearm_checks(self.executive, max_late_percent),
            commanded=commanded,
            last_safe_state=partial(last_safe_state, files),
            enable=partial(self.hardware.enable, enabled=True),
            log=self._log,
        )
        if self.linked is not None:
            self.linked.arming = arming
        watch_sleep(self.executive, arming)
        return arming

    def _retune(self, settings: Any) -> None:  # noqa: ANN401 -- any board's
        """Let the robot take up settings, be it recorded or not."""
        self.robot.retune(settings)
        self._edge.retuned(settings)

    def _end(self, _at: int, ending: Ending) -> None:
        if ending.failed and not self.robot.ends_on_failure:
            return
        self._end_with(ending)

    def _end_with(self, ending: Ending) -> None:
        self.ending = ending
        self.executive.request_stop(ending.reason)
