"""One robot put together for one run: board, buses or rig, model, executive."""

from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firmware_runtime.board.ending import Ending
from firmware_runtime.board.ends import BoardEnd, robot_of
from firmware_runtime.board.lines import Lines, absent_lines
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Doubles, Rig
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.part import Part
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.errors import text_of
from firmware_runtime.executive.clocks import (
    Clock,
    MonotonicClock,
    OutsideClock,
    WorldClock,
)
from firmware_runtime.executive.loop import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.hal.errors import HalError
from firmware_runtime.hal.interlock import always_enabled
from firmware_runtime.hal.served.client import ServedDoubles
from firmware_runtime.links.address import OpenChannel
from firmware_runtime.links.dover_blocks import DoverBlocks
from firmware_runtime.links.ports import Ports
from firmware_runtime.links.ports_socket import PortsSocket
from firmware_runtime.runs.arming import Arming, Permission
from firmware_runtime.runs.board_configuration import configuration_of
from firmware_runtime.runs.dover import dover_link
from firmware_runtime.runs.kept_by_run import keep_clear_of_other_runs
from firmware_runtime.runs.lines import close_lines, open_lines
from firmware_runtime.runs.linking import LinkedEnd, LinkedPart, check_end
from firmware_runtime.runs.outputs import switched_off
from firmware_runtime.runs.overload import ANY_LOAD, Overload
from firmware_runtime.runs.prearm_checks import prearm_checks
from firmware_runtime.runs.quitting import quitting_is_a_bug
from firmware_runtime.runs.requests import Requests
from firmware_runtime.runs.rigs import blamed_on_rig, of_rig, rig_for, served_doubles, shown_by
from firmware_runtime.runs.settings_in_force import forget_settings, keep_settings
from firmware_runtime.runs.tuning import Tuning
from firmware_runtime.statistics.companions import Companion

if TYPE_CHECKING:
    from firmware_runtime.links.dover import DoverLink


class Session:
    """A robot whose chips have answered, ready to run.

    `doubles` are made for the run (True), served at a path, or absent on the real robot (False);
    `rig` is there only if they were made. With a `permission` the run drives its outputs only while
    it is armed, see `arming`; without one always. With an `end` it runs that part of the model
    only, tied to the other by `link`; one without hardware opens no lines. `log` prints what
    happens, in sentences. Raises ConfigError for settings that do not fit the model,
    StatisticsFileError if another robot's run keeps its statistics at that path, and HalError when
    a bus or chip is missing; nothing was actuated then.
    """

    def __init__(  # noqa: PLR0913, PLR0915 -- one path for the command and for programs
        self,
        board: Board,
        clock: Clock,
        *,
        doubles: bool | Path,
        statistics_path: Path | None,
        permission: Permission | None = None,
        end: BoardEnd | None = None,
        link: OpenChannel | None = None,
        log: Callable[[str], None] = lambda _: None,
    ) -> None:
        check_end(end, link, clock)
        self.board = board
        self.end_of_board = end
        self.has_hardware = end is None or end.has_hardware
        self._doubles = doubles if self.has_hardware else False
        self._statistics_path = statistics_path
        self._is_safe = False  # by the last attempt to switch off
        # the instant that doubles and their world live in, ns since the start of the run
        is_own = self._doubles is True
        self.world_now = WorldClock() if is_own else OutsideClock(clock.now)
        self.rig: Rig | None = rig_for(board, self.world_now) if is_own else None
        self.doubles: Doubles | None = self.rig
        self._held: list[ServedDoubles | Requests | PortsSocket | LinkedEnd | DoverLink] = []
        self._lines = Lines({})
        with ExitStack() as undo:
            undo.callback(self.close)
            if isinstance(self._doubles, Path):
                self.doubles = served = served_doubles(board, self._doubles)
                self._held.append(served)
            self._lines = self._open_lines(permission)
            self.replaced: str | None = None
            """What is wrong with the file that this run's statistics replace, if it is damaged."""
            if statistics_path is not None:
                self.replaced = keep_clear_of_other_runs(statistics_path)
            whole = board.build(self._lines)
            ports = Ports(whole.model)  # the world's own are none of them
            if self.rig is not None:
                with blamed_on_rig(board, "attach"):
                    self.rig.attach(whole.model)
            self.robot: Robot = whole
            self.part: Part | None = None
            if end is not None:
                self.robot, self.part = robot_of(end, whole)
                ports = ports.of_part(self.part)
            blocks = DoverBlocks(self.robot.model, clock)
            self.executive = Executive(
                self.robot.model,
                clock,
                self.make_safe,
                replace(
                    configuration_of(
                        board, self.robot.model, self._lines, () if end is None else end.elsewhere
                    ),
                    statistics_path=statistics_path,
                    armed_at_start=permission is None and self.has_hardware,
                    has_link=link is not None,
                    conditions=self._conditions(),
                ),
                self.world_now,
            )
            self._serve(ports)
            self.dover = dover_link(blocks, self.executive)
            """What the model's blocks of `models.dover` send and receive; None if it has none."""
            self._held += [] if self.dover is None else [self.dover]
            self.ending: Ending | None = None
            self.linked = None if link is None else self._linked(link, log)
            self.arming = None if permission is None else self._arming(permission, log)
            self.tuning = Tuning(board, self._retune)
            self._take_requests(log)
            if self.robot.ended is not None:
                self.executive.simulator.listen(self.robot.ended, self._end)
            self._watch_load(log)
            self.robot.find_chips()
            if permission is None:
                self._enable(enabled=True)
            undo.pop_all()

    @property
    def is_outside(self) -> bool:
        """Whether its outputs are outside of this process, on chips or on doubles that are served.

        They stay as they are while nothing runs here, and others can switch them off.
        """
        return self._doubles is not True and self.has_hardware

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
        self._keep_settings()
        try:
            with quitting_is_a_bug(self.robot.model):
                return self._parted(self.executive.run(until))
        finally:
            self._forget_settings()

    def run_on(self, until: int) -> Outcome:
        """Run to instant `until` and pause there; again, go on to a later one.

        Outputs outside of this process are off in a pause, and the run is armed again when it goes
        on; if they cannot be switched off, the run ends. In a world within this process nothing
        passes, so nothing has to be off.
        """
        if self.executive.reached == 0:
            self._keep_settings()
        try:
            outcome = self.executive.run_on(until)
        finally:
            if self.executive.is_over:
                self._forget_settings()
        if self.executive.is_over:
            return self._parted(outcome)
        if self.arming is not None and self.is_outside and self.arming.pause():
            return self.end() or outcome
        return outcome

    def end(self) -> Outcome | None:
        """End a paused run with all outputs off; None if it never began or is over."""
        outcome = self.executive.end()
        if outcome is not None:
            self._forget_settings()
            self._parted(outcome)
        return outcome

    def result(self) -> dict[str, object]:
        """How the run ended: the world's truth on doubles, else what the robot itself knows."""
        own = self.robot.own_result()
        if self.doubles is not None:
            with suppress(HalError), blamed_on_rig(self.board, "result"):  # the server has gone
                true = self.doubles.result(self.world_now.step_at, own)
                return of_rig(self.board, "result", true)
        return own

    def outputs(self) -> dict[str, int] | None:
        """How many outputs of each chip are on; None where that is unknown."""
        if self.doubles is not None:
            with suppress(HalError), blamed_on_rig(self.board, "outputs"):  # the server has gone
                return of_rig(self.board, "outputs", self.doubles.outputs)
        return None

    def make_safe(self) -> list[str]:
        """Disable all outputs at once where a line can, then write full-off to every chip.

        Returns what failed, one sentence each.
        """
        failed: list[str] = []
        try:
            self._enable(enabled=False)
        except HalError as error:
            failed.append(text_of(error))
        failed += self.robot.make_safe()
        self._is_safe = not failed
        return failed

    def close(self) -> None:
        """Release buses, sockets and doubles that are served."""
        close_lines(self._lines)
        for held in self._held:
            held.close()

    # ---------------------------------------------------------------------------------------------

    def _keep_settings(self) -> None:
        """Leave word of the outputs that will be driven; not of those within this process."""
        if self._statistics_path is not None and self.is_outside:
            keep_settings(self.board, self._statistics_path)

    def _parted(self, outcome: Outcome) -> Outcome:
        """The run is over: the other end learns of it, and why."""
        if self.linked is not None:
            self.linked.say_goodbye(outcome, self.ending)
        return outcome

    def _forget_settings(self) -> None:
        """Take that word back if all outputs are off, however the run ended."""
        if self._is_safe and self._statistics_path is not None and self.is_outside:
            forget_settings(self._statistics_path)

    def _open_lines(self, permission: Permission | None) -> Lines:
        """The robot's lines, or absent ones where the hardware is at the other end."""
        if not self.has_hardware:
            return absent_lines(self.board.settings.buses, self.board.ports)
        interlock = always_enabled if permission is None else self._may_drive
        return open_lines(self.board, self.doubles, interlock, self.world_now)

    def _linked(self, open_channel: OpenChannel, log: Callable[[str], None]) -> LinkedEnd:
        """The link to the other end."""
        assert self.end_of_board is not None  # noqa: S101 -- `check_end` has refused it
        assert self.part is not None  # noqa: S101 -- likewise
        part = LinkedPart(self.board, self.end_of_board, self.part, self.executive)
        linked = LinkedEnd(part, open_channel, self._end_with, log)
        self._held.append(linked)
        return linked

    def _may_drive(self) -> bool:
        """Output interlock of a run that may not drive of itself."""
        return self.arming is not None and self.arming.interlock()

    def _enable(self, *, enabled: bool) -> None:
        """Let outputs through or not, where a line decides. Raises HalError."""
        if self._lines.enable is not None:
            self._lines.enable.set(enabled)

    def _serve(self, ports: Ports) -> None:
        """Let other processes put values in and watch, in real time, if they can find it."""
        if self._statistics_path is not None and isinstance(self.executive.clock, MonotonicClock):
            path = Companion.PORTS.beside(self._statistics_path)
            self._held.append(PortsSocket(path, ports, self.executive))

    def _arming(self, permission: Permission, log: Callable[[str], None]) -> Arming:
        """What decides whether outputs may be driven."""
        max_late_percent = self.board.settings.arming.max_late_percent
        arming = Arming(
            self.executive,
            permission,
            self.make_safe,
            prearm_checks(self.executive, max_late_percent),
            link=None if self.linked is None else self.linked.link.why_not,
            enable=partial(self._enable, enabled=True),
            log=log,
        )
        if self.linked is not None:
            self.linked.arming = arming
        return arming

    def _take_requests(self, log: Callable[[str], None]) -> None:
        """Let other processes arm it, disarm it and change its gains, if they can find it."""
        if self._statistics_path is not None:
            path = Companion.CONTROL.beside(self._statistics_path)
            self._held.append(Requests(path, self.executive, self.arming, self.tuning, log))

    def _retune(self, settings: Any) -> None:  # noqa: ANN401 -- any board's
        """Let the robot take up settings, be it recorded or not."""
        self.robot.retune(settings)

    def _watch_load(self, log: Callable[[str], None]) -> None:
        """Keep a run in real time from taking the machine for itself."""
        settings = self.board.settings.executive
        is_real = isinstance(self.executive.clock, MonotonicClock)
        if is_real and settings.max_load_percent < ANY_LOAD:
            limit, policy = settings.max_load_percent, settings.overload
            Overload(self.executive, limit, policy, self.supervision, log)

    def _end(self, _at: int, ending: Ending) -> None:
        if ending.failed and not self.robot.ends_on_failure:
            return
        self._end_with(ending)

    def _end_with(self, ending: Ending) -> None:
        self.ending = ending
        self.executive.request_stop(ending.reason)

    def _conditions(self) -> dict[str, Any]:
        """The board, and how a guard would switch it off; doubles made for the run have none."""
        end = self.end_of_board
        conditions: dict[str, Any] = {
            "board": self.board.name if end is None else end.name,
            "board_sha256": self.board.fingerprint,
        }
        if end is not None:
            conditions["role"] = end.role
        if not self.is_outside:
            return conditions
        served = self._doubles if isinstance(self._doubles, Path) else None
        return {**conditions, "switched_off": switched_off(self.board, served)}
