"""Hardware of a run: chips on their lines, doubles made for it, or doubles that are served."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn

from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Doubles, Rig
from firmware_runtime.board.rigs import blamed_on_rig, of_rig, rig_for, served_doubles
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock, OutsideClock, VirtualClock, WorldClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.hal.interlock import Interlock
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.recording.blackbox.recorder import Recorder
from firmware_runtime.runs.open_lines import close_lines, open_lines, soon_free
from firmware_runtime.runs.outputs import switched_off
from firmware_runtime.system.this_system import demand_linux

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd
    from firmware_runtime.board.struck_doubles import StruckDoubles
    from firmware_runtime.hal.served.client import ServedDoubles
    from firmware_runtime.hal.strike import Strike
    from firmware_runtime.runs.arming import Arming
    from firmware_runtime.runs.scripted_operator import ScriptedOperator
    from firmware_runtime.runs.tuning import Tuning


SERVED_WITHIN_S: Final = 3.0
"""How long a run waits for the doubles at a path: their server may have been started beside it."""


class Hardware:
    """The lines of a run, open from construction until `close`, and what is behind them.

    `rig` is there if doubles were made for the run (True); they are served at a path, or absent on
    the real robot (False). Of a run without hardware, as `is_here` says, all lines are absent.
    `world_now` is the instant that doubles and their world live in, ns since the start of the run.
    Raises ConfigError, also on a system without such lines, and HalError when a bus or a server is
    missing.
    """

    def __init__(  # noqa: PLR0913 -- put together once, by the session
        self,
        board: Board,
        clock: Clock,
        doubles: bool | Path,  # noqa: FBT001 -- as the session's
        interlock: Interlock,
        *,
        is_here: bool,
        recorder: Recorder | None = None,
    ) -> None:
        self.is_here = is_here
        self._board = board
        is_own = is_here and doubles is True
        self.is_outside = is_here and not is_own
        """Whether outputs are outside of this process, on chips or on doubles that are served."""
        if self.is_outside:
            demand_linux("a run that has its outputs outside of its process")
        self._served_at = doubles if is_here and isinstance(doubles, Path) else None
        self.world_now = WorldClock() if is_own else OutsideClock(clock.now)
        self.rig: Rig | None = rig_for(board, self.world_now) if is_own else None
        self._stall = clock.stall if isinstance(clock, VirtualClock) else None
        self._operator: ScriptedOperator | None = None
        self._commanded: tuple[Executive, Callable[[], Arming], Tuning] | None = None
        self._struck: StruckDoubles | None = None
        self._served: ServedDoubles | None = None
        if (path := self._served_at) is not None:
            self._served = soon_free(lambda: served_doubles(board, path, wait_s=SERVED_WITHIN_S))
        self.doubles: Doubles | None = self._served if self.rig is None else self.rig
        self.lines = Lines({})
        try:
            self.lines = self._open_lines(interlock, recorder)
        except BaseException:
            self.close()
            raise

    def attach(self, robot: Robot) -> None:
        """Tie the rig's world to a robot, where there is one."""
        if self.rig is not None:
            with blamed_on_rig(self._board, "attach"):
                self.rig.attach(robot.model)

    def command(
        self, executive: Executive, arming: "Callable[[], Arming]", tuning: "Tuning"
    ) -> None:
        """Let a script of faults disarm this run, arm it again, reload it; most have none."""
        self._commanded = executive, arming, tuning
        self._attend()

    @property
    def struck(self) -> "StruckDoubles":
        """Doubles of this run and their faults. Raises ConfigError where there are none."""
        if self._struck is None:
            # of few runs
            from firmware_runtime.board.struck_doubles import StruckDoubles  # noqa: PLC0415
            from firmware_runtime.runs.scripted_operator import ScriptedOperator  # noqa: PLC0415

            if self.rig is None:
                refuse_faults(self._board.name, self._served_at or False)
            self._operator = ScriptedOperator()
            self._attend()
            self._struck = StruckDoubles(
                self.rig,
                self._board,
                self.world_now,
                self._stall,
                self._operator,
                partial(blamed_on_rig, self._board),
            )
        return self._struck

    def strike(self, script: "Sequence[Strike]") -> None:
        """Make the faults of a script. Raises ConfigError with every one that cannot be made."""
        refused = []
        for each in script:
            try:
                self.struck.strike(each)
            except ConfigError as error:
                refused += [f"fault: {fault}" for fault in error.faults]
        if refused:
            raise ConfigError(self._board.name, refused)

    def enable(self, *, enabled: bool) -> None:
        """Let outputs through or not, where a line decides. Raises HalError."""
        if self.lines.enable is not None:
            self.lines.enable.set(enabled)

    def result(self, own: dict[str, object]) -> dict[str, object]:
        """Return how the run ended: the world's truth on doubles, else what the robot knows."""
        if self.doubles is not None:
            with suppress(HalError), blamed_on_rig(self._board, "result"):  # the server has gone
                true = self.doubles.result(self.world_now.step_at, own)
                return of_rig(self._board, "result", true)
        return own

    def outputs(self) -> dict[str, int] | None:
        """Return how many outputs of each chip are on; None where that is unknown."""
        if self.doubles is not None:
            with suppress(HalError), blamed_on_rig(self._board, "outputs"):  # the server has gone
                return of_rig(self._board, "outputs", self.doubles.outputs)
        return None

    def conditions(self, end: "BoardEnd | None") -> dict[str, object]:
        """The board, its doubles, and how a guard would switch it off.

        `doubles` is where they are served, or True for those made for the run, which no guard
        switches off; a run on chips has no such key.
        """
        conditions: dict[str, object] = {
            "board": self._board.name if end is None else end.name,
            "board_sha256": self._board.fingerprint,
        }
        if end is not None:
            conditions["role"] = end.role
        if self.is_outside:
            conditions["switched_off"] = switched_off(self._board, self._served_at)
        if self._served_at is not None:
            conditions["doubles"] = str(self._served_at.resolve())
        elif self.rig is not None:
            conditions["doubles"] = True
        return conditions

    def close(self) -> None:
        """Release buses and ports, and doubles that are served."""
        close_lines(self.lines)
        if self._served is not None:
            self._served.close()

    def _attend(self) -> None:
        """Let the operator attend the run, once there are both."""
        if self._operator is not None and self._commanded is not None:
            executive, arming, tuning = self._commanded
            self._operator.attend(executive, arming(), tuning)

    def _open_lines(self, interlock: Interlock, recorder: Recorder | None) -> Lines:
        """The robot's lines, or absent ones where the hardware is at the other end."""
        if not self.is_here:
            return self._board.absent_lines()
        return open_lines(self._board, self.doubles, interlock, self.world_now, recorder)


def refuse_faults(board: str, doubles: bool | Path) -> NoReturn:  # noqa: FBT001 -- as a run's
    """Raise ConfigError: faults are made on doubles that are in the process of the run."""
    fault = "faults are made on doubles of this run's own"
    if isinstance(doubles, Path):
        expected = f"`firmware-runtime doubles fault --socket {doubles}` for those that are served"
    else:
        expected = "doubles that are made for it, by --doubles"
    raise ConfigError.of_one(board, fault, expected)


class RecordedRobot(Struct, frozen=True):
    """Robot that runs here, and what records it."""

    recorder: Recorder
    executive: Executive
    robot: Robot
    lines: Lines
    board: Board
    end: "BoardEnd | None"
    rig: Rig | None
    """Its doubles and their world, where they are in this process."""
