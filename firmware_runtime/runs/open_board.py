"""A robot in the hands of a program: a test, a notebook, a script.

It goes through the same session as the command `run`: the same settings, refusals, pre-arm checks,
guard and sockets. What differs is that it can be run in stretches and looked at in between.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.board.ends import end_of
from firmware_runtime.board.local_settings import board_in_force, settings_in_force
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, UnknownName
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.hal.strike import Strike, Struck
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.recording.blackbox.locations import recording_beside
from firmware_runtime.recording.blackbox.taps import output_ports
from firmware_runtime.runs.arming import permission_for
from firmware_runtime.runs.end_link import idle_options
from firmware_runtime.runs.open_run import OpenRun, RunResult
from firmware_runtime.runs.options import (
    ClockName,
    clock_faults,
    clock_name,
    clock_of,
    demand,
    path_of,
)
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session, way_of
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.paths import check_ending, default_path
from firmware_runtime.statistics.port_values import PortValues, table_of
from firmware_runtime.system.atomic_file import why_not_writable

if TYPE_CHECKING:
    from firmware_runtime.recording.exports.recorded_run import RecordedRun

Settings = Mapping[str, object]
"""Numbers of board.toml by their dotted keys."""

_AS_IT_IS: Settings = MappingProxyType({})


class OpenBoard(OpenRun):
    """A robot whose chips have answered; `close` switches all outputs off, however it ran.

    Outputs of a real robot, and of doubles in another process, are off between two calls of `run`.
    """

    def __init__(
        self,
        session: Session,
        default_for_s: float | None,
        record: Path | None = None,
        log: Callable[[str], None] = lambda _: None,
    ) -> None:
        super().__init__(session.executive)
        self._session = session
        self._default_for_s = default_for_s
        self._record = record
        self._log = log

    @property
    def board(self) -> Board:
        """The board and its settings, as they are in force."""
        return self._session.board

    @property
    def model(self) -> Coupled:
        """The robot's model: its components, their ports and attributes."""
        return self._session.robot.model

    @property
    def session(self) -> Session:
        """What it was put together from: for what looks at a run closer than a program does."""
        return self._session

    @property
    def rig(self) -> Rig | None:
        """The doubles and the lines they are on, if they are in this process."""
        return self._session.hardware.rig

    @property
    def world(self) -> Any:  # noqa: ANN401 -- a world is of its board's own class
        """The world behind the doubles, brought up to now; None where there is none."""
        rig = self._session.hardware.rig
        if rig is None:
            return None
        rig.catch_up()
        return getattr(rig, "world", None)

    @property
    def now(self) -> int:
        """The present instant of doubles and their world, ns since the start of the run."""
        return self._session.hardware.world_now()

    @property
    def result(self) -> dict[str, object]:
        """Result of the run so far: the world's truth on doubles, else what the robot knows."""
        return self._session.result()

    @property
    def outputs(self) -> dict[str, int] | None:
        """Outputs that are on, by chip; None on a real robot, where it cannot be seen."""
        return self._session.outputs()

    @property
    def struck(self) -> list[Struck]:
        """Faults that were made on its doubles, those of its script and of `strike`.

        Raises ConfigError where its doubles are not in this process.
        """
        return list(self._session.hardware.struck.struck)

    def strike(
        self,
        kind: str,
        device: str = "",
        *,
        for_s: float | None = None,
        amount: float | None = None,
    ) -> None:
        """Break something on its doubles now, as `Strike` says; not while it runs.

        Raises ConfigError for a fault that cannot be made.
        """
        self._session.hardware.strike([Strike(kind, device, 0.0, for_s, amount)])

    def clear_faults(self) -> None:
        """End all faults of its doubles; what had no supply is in its power-up state."""
        self._session.hardware.struck.clear()

    @property
    def armed(self) -> bool:
        """Return whether its outputs may be driven."""
        arming = self._session.arming
        return arming is None or arming.armed

    @property
    def was_armed(self) -> bool:
        """Return whether its outputs could be driven at any time so far."""
        arming = self._session.arming
        return arming is None or arming.was_armed

    @property
    def why_not_armed(self) -> str | None:
        """Reason why it is not armed, in a sentence; None if it is."""
        arming = self._session.arming
        return None if arming is None or arming.armed else arming.reason

    def run(self, for_s: float | None = None) -> RunResult:
        """Run for so many seconds; again, go on. Without a number, as the command `run` would.

        That is for as long as the board says on doubles, else until it is over or stopped.
        Raises what a model's run raises, and HalError if outputs could not be switched off.
        """
        return super().run(self._default_for_s if for_s is None else for_s)

    def values(self) -> dict[str, PortValues[Any]]:
        """Return all that has passed the run's ports so far, by their paths.

        Of a run that is recorded: under way, or closed with `record`. Raises ConfigError otherwise.
        """
        recorded = self._recorded()
        return {} if recorded is None else recorded.values()

    def to_dataframe(self) -> Any:  # noqa: ANN401 -- as `PortValues.to_dataframe`
        """Return all of that as one table, a row for each instant at which a port sent something.

        A column is called by port and field, such as `imu.sample.rate.2`. It is a DataFrame of
        pandas, or without pandas a Table of pyarrow. Raises ConfigError without either, and as
        `values` does.
        """
        return table_of(self.values())

    def close(self) -> RunResult | None:
        """End the run with all outputs off, and release the buses. Closing twice is harmless.

        Raises HalError if some output could not be switched off.
        """
        if self._is_closed:
            return None
        try:
            if self._executive.reached == 0 and not self._executive.is_over:
                self._switch_off()
            return super().close()
        finally:
            try:
                self._session.close()
            finally:
                self._keep()  # a file: not before the hardware is released

    # ---------------------------------------------------------------------------------------------

    def _keep(self) -> None:
        """Keep the recording."""
        if self._record is None:
            return
        fault = self._session.edge.keep_into(self._record)
        if fault is not None:
            self._log(f"warning: {fault}")

    def _recorded(self) -> "RecordedRun | None":
        """The run so far, by its recording; None before it begins. Raises ConfigError."""
        edge = self._session.edge
        kept = self._record if self._is_closed else edge.kept
        if edge.recorder is None or (self._is_closed and kept is None):
            expected = "open_board(..., record=FILE), and recording.minutes above 0"
            fault = "nothing of this run is recorded"
            raise ConfigError.of_one(self.board.name, fault, expected=expected)
        if kept is None or not self._executive.has_begun:
            return None
        # of a program that asks for values, and no other
        from firmware_runtime.recording.blackbox.reader import read_recording  # noqa: PLC0415
        from firmware_runtime.recording.exports.recorded_run import RecordedRun  # noqa: PLC0415

        atomics = self._executive.simulator.atomics
        ports = {below_root(port.path): port for port in output_ports(atomics)}
        return RecordedRun(read_recording(kept), ports)

    def _passed_so_far(self, path: str) -> Iterable[tuple[int, Any]] | None:
        if self._session.edge.recorder is None:
            return None
        recorded = self._recorded()
        if recorded is None:
            return ()
        try:
            port = recorded.port(path)
        except UnknownName:  # nothing can leave it: it leads nowhere
            return ()
        return zip(port.times_ns(), port.values(), strict=True)

    def _switch_off(self) -> None:
        """Switch off what never ran: something before it may have left outputs on."""
        if failed := self._session.make_safe():
            self._is_closed = True
            raise self._failure("; ".join(failed))

    def _run_to(self, until: int) -> Outcome:
        return self._session.run_on(until)

    def _end(self) -> Outcome | None:
        return self._session.end()

    def _result(self, outcome: Outcome) -> RunResult:
        result = super()._result(outcome)
        return replace(result, state=RunState.FAILED) if self._session.task.has_failed else result

    def _failure(self, faults: str) -> FirmwareRuntimeError:
        return HalError(faults, where="not made safe")


def open_board(  # noqa: PLR0913 -- the options of the command, by the same names
    board: str | PathLike[str],
    *,
    doubles: bool | str | PathLike[str] = False,
    clock: ClockName | Clock = "monotonic",
    speed: float | None = None,
    set: Settings = _AS_IT_IS,  # noqa: A002 -- as the command has it
    arm: bool = False,
    supervised: bool = False,
    role: str | None = None,
    link: str | None = None,
    statistics: str | PathLike[str] | None = None,
    record: str | PathLike[str] | None = None,
    faults: Iterable[Strike] = (),
    log: Callable[[str], None] = lambda _: None,
) -> OpenBoard:
    """A robot ready to run, by the choices of the command `run`; close it, or use it in a `with`.

    `board` is a board's name, which means its settings in force on this machine, or the path of a
    board.toml or its folder; `set` overrides single numbers of it: `set={"controller.yaw.kp":
    0.8}`. `doubles` are made for the run (True) or served at a path. The outputs of a real robot
    (`doubles=False`) are driven only while it is armed: by `arm=True`, by the board's `[arming]
    at_start`, or by `firmware-runtime arm` while it runs, and each time only once nothing speaks
    against it. With a `role` only that part of the model runs, and `link` says over what it speaks
    with the rest, in another process, see docs/stages.md; a role without hardware has no
    doubles. `statistics` are kept in a file where it is given, and where outputs are outside this
    process: the guard looks there, and beside them is what entered the run, for `firmware-runtime
    replay`. `record` is a file that has this recording once the robot is closed. `faults` are
    what breaks on doubles made for the run, and when: `[Strike("freeze", "imu", at_s=2.0,
    for_s=1.0)]`. `log` gets what the command would print on the way. Raises ConfigError, and
    HalError when a bus or chip is missing.
    """
    name = clock_name(clock, speed)
    where = _doubles(doubles)
    for what, stated in (("arm", arm), ("supervised", supervised)):
        demand(what, stated, "True or False", is_sound=isinstance(stated, bool))  # "no" is true
    demand("log", log, "a function", is_sound=callable(log))
    kept_at, recording = path_of("statistics", statistics), path_of("record", record)
    if recording is not None and (why := why_not_writable(recording)) is not None:
        fault = f"{recording}: cannot be written ({why}); expected a file that can be written"
        raise ConfigError("record", [fault])
    found = _board(str(board), set, log)
    end = None if role is None else end_of(found, role)
    has_hardware = end is None or end.has_hardware
    refused = idle_options(end, doubles=where, arm=arm, supervised=supervised)
    refused += clock_faults(name, speed, doubles=where or not has_hardware)
    if refused:
        raise ConfigError("run", refused)
    statistics_path = _statistics_path(
        kept_at,
        found.name if end is None else end.name,
        is_outside=where is not True and has_hardware,
    )
    session = start_session(
        found,
        clock_of(clock, speed),
        doubles=where,
        statistics_path=statistics_path,
        recording=recording if statistics_path is None else recording_beside(statistics_path),
        permission=permission_for(found, doubles=where, arm=arm, supervised=supervised, end=end),
        end=end,
        link=way_of(link),
        faults=_script(faults),
        log=log,
    )
    return OpenBoard(session, found.doubles_run_s if where else None, recording, log)


def _board(board: str, settings: Settings, log: Callable[[str], None]) -> Board:
    """The board with these settings; it is logged where they are not those that are shipped."""
    found = board_in_force(board, assignments_of(settings))
    if (copy := settings_in_force(board)) is not None:
        log(f"{board} has its settings from {copy}")
    return found


def _script(faults: Iterable[Strike]) -> list[Strike]:
    """The faults of a script. Raises ConfigError for what is none."""
    stated: object = faults
    script = list(stated) if isinstance(stated, Iterable) else [stated]
    sound = [each for each in script if isinstance(each, Strike)]
    is_sound = isinstance(stated, Iterable) and sound == script
    demand("faults", faults, 'a list such as [Strike("freeze", "imu")]', is_sound=is_sound)
    return sound


def _doubles(stated: bool | str | PathLike[str]) -> bool | Path:  # noqa: FBT001 -- or a path
    if isinstance(stated, bool):
        return stated
    if isinstance(stated, str | PathLike):
        return Path(stated)
    expected = "expected True, False, or the path where they are served"
    raise ConfigError("doubles", [f"{stated!r}: {expected}"])


def _statistics_path(stated: Path | None, name: str, *, is_outside: bool) -> Path | None:
    if stated is None:
        return default_path(name) if is_outside else None
    check_ending(stated)
    return stated
