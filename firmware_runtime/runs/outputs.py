"""A board's outputs, held by a process that runs no model: all it can do is switch them off.

A board's file may be changed, or broken, while a robot runs by what stood there before. Switching
that run off must reach its chips and not those of the file: `BOARD.settings` has them until its
outputs are off, overrides of the command line included, and the path of the file they came from:

    {"source": "/home/pi/mine.toml", "table": {"board": "tachobot", ...}}
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from firmware_runtime.board.local_settings import is_kept_of, kept_table, load_table
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rigs import served_doubles
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.errors import ConfigError, StatisticsFileError, text_of
from firmware_runtime.hal.unopened_lines import NotingBus, NotingPort, check_node
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.runs.open_lines import close_lines, reach_lines
from firmware_runtime.statistics.paths import SUFFIX, Companion
from firmware_runtime.system.atomic_file import OWN_AND_GROUP, replace_file


def keep_settings(board: Board, statistics: Path) -> None:
    """Keep a board's settings; the file is whole at any instant. Raises StatisticsFileError."""
    path = Companion.SETTINGS.beside(statistics)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, kept_table(board).encode(), OWN_AND_GROUP)
    except OSError as error:
        raise StatisticsFileError(
            error.strerror, where=path, expected="a place to write"
        ) from error


def kept_settings(statistics: Path | None) -> Board | None:
    """Return what a run left in force; None if all its outputs are off, or it is not legible."""
    if statistics is None:
        return None
    try:
        return load_table(Companion.SETTINGS.beside(statistics))
    except ConfigError:
        return None


def kept_for(board: str, directories: Iterable[Path]) -> list[Path]:
    """The statistics of the runs in these directories whose settings came from this file."""
    return [
        path.with_suffix(SUFFIX)
        for directory in directories
        for path in sorted(directory.glob(f"*{Companion.SETTINGS}"))
        if is_kept_of(path, board)
    ]


def forget_settings(statistics: Path | None) -> None:
    """To be called when all outputs are off; what may not be removed stays, to be switched off."""
    if statistics is not None:
        with suppress(OSError):
            Companion.SETTINGS.beside(statistics).unlink()


def switched_off(board: Board, doubles: Path | None) -> list[str]:
    """Return what switching this board off writes, and where: device, address, bytes.

    Of doubles the device is where they are served and the line's name there. Runs and guards that
    agree in this mean the same chips.
    """
    notes: list[str] = []

    def place(name: str, device: str) -> str:
        return device if doubles is None else f"{doubles.resolve()} {name}"

    buses = {
        name: NotingBus(name, place(name, bus.device), notes)
        for name, bus in board.settings.buses.items()
    }
    ports = {
        name: NotingPort(name, place(name, port.device), notes)
        for name, port in board.ports.items()
    }
    board.build(Lines(buses, ports)).make_safe()
    return notes


class Outputs:
    """Opens the board's buses once and keeps them open; opens them again after every failure.

    A bus that cannot be opened keeps no other from being written to; one that cannot be opened
    again is used as it is. `doubles` is where they are served, None on the real robot; a run keeps
    its statistics at `statistics`, and beside them its settings. Nothing is locked: the process
    that drives the outputs at the time cannot keep us out.
    """

    def __init__(self, board: Board, doubles: Path | None, statistics: Path | None) -> None:
        self._board = board
        self._statistics = statistics
        self._doubles = doubles
        self._opened: tuple[Lines, Robot] | None = None
        self._has_failed = False

    def prepare(self) -> None:
        """Import, build and open now what switching off takes, as far as it is there."""
        switched_off(self._board, self._doubles)
        with suppress(HalError, ConfigError):  # it may come later, with the run
            self._open()

    def make_safe(self) -> list[str]:
        """Write full-off to every chip; return what failed, one sentence each."""
        try:
            failed = self._robot().make_safe()
        except HalError as error:
            failed = [text_of(error)]
        self._has_failed = failed != []
        return failed

    def outputs_on(self) -> list[str]:
        """Return what is on by what can be read back, one sentence each."""
        try:
            return self._robot().outputs_on()
        except HalError as error:
            return [text_of(error)]

    @property
    def unseen(self) -> Sequence[str]:
        """Chips that cannot be read back. Raises HalError where nothing can be opened."""
        return self._robot().unseen

    def why_unguarded(self, conditions: Mapping[str, Any]) -> str | None:
        """Return why a run under these conditions would not be switched off from here, if so.

        A run on doubles of its own says nothing of its outputs: no other process could reach them.
        """
        theirs = conditions.get("switched_off")
        if theirs is None:
            return None
        own = switched_off(self._board, self._doubles)
        if theirs != own and not self._take_up_settings_for(theirs):
            return (
                f"its outputs go off by {', '.join(theirs)}, here by {', '.join(own)}; expected "
                "the same settings"
            )
        return self._unserved()

    def reach(self) -> None:
        """Open every bus and port, and keep them open. Raises HalError where one cannot be."""
        if self._doubles is None:
            for name, line in (self._board.settings.buses | self._board.ports).items():
                check_node(name, line.device)
            self._open()

    def close(self) -> None:
        """Release the buses."""
        if self._opened is not None:
            close_lines(self._opened[0])
            self._opened = None

    def _unserved(self) -> str | None:
        """Return why doubles cannot be switched off, if so: not served, or silent."""
        if self._doubles is not None:
            try:
                self._open()
            except (HalError, ConfigError) as error:
                return text_of(error)
        return None

    def _take_up_settings_for(self, outputs: list[str]) -> bool:
        """Return whether the settings that the run keeps mean these outputs; then take them up."""
        board = kept_settings(self._statistics)
        if board is None or switched_off(board, self._doubles) != outputs:
            return False
        self.close()
        self._board = board
        return True

    def _robot(self) -> Robot:
        """The robot on its lines, opened again after a failure. Raises HalError if it cannot be."""
        if self._opened is None:
            self._open()
        elif self._has_failed:
            with suppress(Exception):  # no descriptor, no memory, no doubles: what is open is used
                self._open()
        return self._opened[1]  # type: ignore[index] # opened, or raised

    def _open(self) -> None:
        doubles = None
        if self._doubles is not None:
            doubles = served_doubles(self._board, self._doubles, alone=False)
        held = None if self._opened is None else self._opened[0]
        lines = reach_lines(self._board, doubles, held)
        self._opened = lines, self._board.build(lines)
