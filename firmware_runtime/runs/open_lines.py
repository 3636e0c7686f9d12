"""A board's buses and ports, opened: the real ones, or those of its doubles."""

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Final, TypeVar

from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Doubles
from firmware_runtime.board.robot import Lines
from firmware_runtime.board.settings import BusSettings
from firmware_runtime.errors import text_of
from firmware_runtime.hal.accounted_bus import AccountedBus, RetryPolicy
from firmware_runtime.hal.accounted_port import AccountedPort
from firmware_runtime.hal.budget import NO_TIME, LineTime
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.interlock import EnableLine, Interlock, always_enabled
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.unopened_lines import AbsentBus, AbsentPort, open_i2c, open_serial
from firmware_runtime.hal.wire_errors import BusInUse, HalError
from firmware_runtime.system.resources import tried_again

if TYPE_CHECKING:  # safe-state has none, and is not to wait for what it imports
    from firmware_runtime.recording.blackbox.recorder import Recorder

Line = TypeVar("Line", I2cBus, SerialPort)
T = TypeVar("T")

FREE_WITHIN_S: Final = 1.0
"""How long a run waits for a line that another process has."""


def open_lines(
    board: Board,
    doubles: Doubles | None,
    interlock: Interlock = always_enabled,
    time: LineTime = NO_TIME,
    recorder: "Recorder | None" = None,
) -> Lines:
    """The doubles' lines or the real ones, buses with their retries and counters, all in one time.

    Every other process that asks for the same is kept out; a recorder taps them. Raises HalError.
    """
    if recorder is not None:
        interlock, time = recorder.interlock(interlock), recorder.time(time)
    opening = _Opening(board, doubles, time, alone=True, recorder=recorder)
    buses: dict[str, I2cBus] = {}
    ports: dict[str, SerialPort] = {}
    enable: EnableLine | None = None
    try:
        enable = doubles.enable if doubles else _enable_line(board)
        for name in board.settings.buses:
            buses[name] = opening.bus(name)
        for name in board.ports:
            ports[name] = opening.port(name)
    except BaseException:
        close_lines(Lines(buses, ports, enable=enable))
        raise
    return Lines(buses, ports, interlock, enable)


def reach_lines(board: Board, doubles: Doubles | None, held: Lines | None = None) -> Lines:
    """Every line that can be opened, for switching off only; the others say why not.

    One that is gone must not keep those that are there from being used. What was `held` before is
    closed, but for a line that can be opened no more: that is kept as it is. No process is kept
    out, and the enable line belongs to the process that drives.
    """
    held = held or Lines({})
    opening = _Opening(board, doubles, NO_TIME, alone=False)
    return Lines(
        {
            name: _reached(name, opening.bus, AbsentBus, held.buses.get(name))
            for name in board.settings.buses
        },
        {
            name: _reached(name, opening.port, AbsentPort, held.ports.get(name))
            for name in board.ports
        },
    )


def _reached(
    name: str, opened: Callable[[str], Line], absent: Callable[[str, str], Line], held: Line | None
) -> Line:
    """A line opened again; where that fails the one that is held, or one that says why not."""
    try:
        line = opened(name)
    except (HalError, OSError) as error:
        return held or absent(name, text_of(error).removeprefix(f"{name}: "))
    if held is not None:
        held.close()
    return line


class _Opening(Struct, frozen=True):
    """Opens lines of a board or of its doubles; `alone`, every other process is kept out."""

    board: Board
    doubles: Doubles | None
    time: LineTime
    alone: bool
    recorder: "Recorder | None" = None

    def bus(self, name: str) -> I2cBus:
        stated, doubles = self.board.settings.buses[name], self.doubles
        if doubles:
            inner = doubles.buses[name]
        elif self.alone:
            inner = soon_free(lambda: self._real_bus(name, stated))
        else:
            inner = self._real_bus(name, stated)
        bus = AccountedBus(
            inner,
            round(stated.speed_hz),
            RetryPolicy(stated.attempts),
            overhead_ns=stated.overhead_ns,
            time=self.time,
        )
        if self.recorder is not None:
            self.recorder.bus(bus, returns_early=inner.returns_early)
        return bus

    def _real_bus(self, name: str, stated: BusSettings) -> I2cBus:
        return open_i2c(name, stated.device, timeout_ms=stated.timeout_ms, alone=self.alone)

    def port(self, name: str) -> SerialPort:
        stated = self.board.ports[name]
        if self.doubles:
            inner = self.doubles.ports[name]
        else:
            inner = open_serial(name, stated.device, stated.baud, alone=self.alone)
        tapped = inner if self.recorder is None else self.recorder.port(inner)
        return AccountedPort(tapped, stated.baud, self.time)


def soon_free(take: Callable[[], T]) -> T:
    """Return what `take` opens, soon after another process let it go.

    Raises BusInUse.
    """
    return tried_again(take, (BusInUse,), FREE_WITHIN_S)


def _enable_line(board: Board) -> EnableLine | None:
    wired = board.settings.output_enable
    if wired is None:
        return None
    from firmware_runtime.hal.linux_gpio import open_enable_line  # noqa: PLC0415 -- few have one

    return open_enable_line("output_enable", wired.chip, wired.line, active_low=wired.active_low)


def close_lines(lines: Lines) -> None:
    """Disable outputs where there is a line for it; release buses and ports.

    An enable line that fails is said where outputs are switched off, and keeps no bus open here.
    """
    if lines.enable is not None:
        with suppress(HalError):
            lines.enable.close()
    for bus in lines.buses.values():
        bus.close()
    for port in lines.ports.values():
        port.close()
