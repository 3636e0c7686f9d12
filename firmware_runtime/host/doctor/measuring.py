"""Measurements for `doctor --measure`: clocks of a board's wires, and the period they allow.

Wires: reads of the identifying register of a chip of the board, as `probe` finds it; nothing else
is sent. Period: the board runs on its doubles in real time, for its own times on this computer and
its lateness, and its steps are predicted with the wires' clocks.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from time import monotonic_ns
from typing import Final

from msgspec import Struct

from firmware_runtime.board.faults import Device
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rigs import rig_for
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError, SettingError, StatisticsFileError
from firmware_runtime.executive.clocks import MonotonicClock, WorldClock
from firmware_runtime.hal.budget import REFUSED_ABOVE_PERCENT
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.unopened_lines import open_i2c
from firmware_runtime.hal.wire_clock import MeasuredWire, measured_clock
from firmware_runtime.hal.wire_errors import BusAbsent, BusInUse, HalError, NoAcknowledge
from firmware_runtime.host.scaffold.chip import CHIPS
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.timing_prediction import LEAST_STEPS, Prediction, predicted
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.paths import all_statistics
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.kernel_files import THIS_MACHINE, SystemFiles, virtualised
from firmware_runtime.system.packages import installed

STRETCH: Final = 5 * SECOND
LONGEST: Final = 60 * SECOND
ON_TIME: Final = 10
"""A period is as many times as long as the lateness of its steps, or more: the usual tolerance."""


class Wire(Struct, frozen=True):
    """A bus of a board: the clock of its wire, or why it is not measured."""

    bus: str
    device: str
    stated_hz: int
    measured: MeasuredWire | None
    said: str
    """The chip that was read, or the reason."""

    @property
    def key(self) -> str:
        """Return the setting that states its clock."""
        return f"buses.{self.bus}.speed_hz"

    @property
    def speed_hz(self) -> int:
        """Return the measured clock, the stated one where none was measured."""
        return self.stated_hz if self.measured is None else self.measured.speed_hz

    @property
    def sentence(self) -> str:
        """Return it in words."""
        if self.measured is None:
            return f"{self.bus}: not measured, {self.stated_hz} Hz stated: {self.said}"
        return (
            f"{self.bus}: {self.measured.speed_hz} Hz measured, {self.stated_hz} Hz stated; "
            f"{self.measured.overhead_us:.0f} us a transaction beside its bits ({self.said})"
        )


def demand_no_run() -> None:
    """Raise ConfigError while a run is under way: measuring beside it would delay it."""
    for path in all_statistics().values():
        with suppress(StatisticsFileError):
            run = read_statistics(path)
            if run.writer_alive and run.state is RunState.RUNNING:
                process = run.header.writer.pid
                under_way = f"process {process} runs {run.header.board or path}"
                raise ConfigError.of_one("doctor --measure", f"{under_way}; end that run first")


def wires_of(board: Board, *, doubles: bool, files: SystemFiles = THIS_MACHINE) -> list[Wire]:
    """Measure every bus of a board, or of its doubles, whose clock is that of their rig.

    Raises BusInUse where a run drives one, and ConfigError for a board without doubles.
    """
    if doubles:
        now = WorldClock()
        rig = rig_for(board, now)
        return [wire_of(board, name, rig.buses[name], now) for name in board.settings.buses]
    return [_on_hardware(board, name, files) for name in board.settings.buses]


def _on_hardware(board: Board, name: str, files: SystemFiles) -> Wire:
    stated = board.settings.buses[name]
    if virtualised(files):
        return _unmeasured(board, name, "a virtual machine has no wire to time")
    try:
        bus = open_i2c(name, stated.device, timeout_ms=stated.timeout_ms, alone=True)
    except BusInUse:
        raise
    except BusAbsent as error:
        return _unmeasured(board, name, error.what)
    with closing(bus):
        return wire_of(board, name, bus, monotonic_ns)


def wire_of(board: Board, name: str, bus: I2cBus, now: Callable[[], int]) -> Wire:
    """Measure a bus by the first chip that answers; one that may stretch the clock is no measure.

    `now` gives the ns in which the bus lives.
    """
    reasons = []
    for device in (each for each in board.devices if each.bus == name):
        place = f"{device.chip} 0x{device.address:02x}"
        if device.stretches_clock:
            reasons.append(f"{place} may stretch the clock")
            continue
        try:
            register = _identifying(bus, device)
            found = measured_clock(bus, device.address, register, now)
        except (HalError, SettingError) as error:
            reasons.append(f"{place}: {error}")
        else:
            stated = board.settings.buses[name]
            return Wire(name, stated.device, round(stated.speed_hz), found, f"reading {place}")
    return _unmeasured(board, name, "; ".join(reasons) or "no chip of the board is on it")


def _unmeasured(board: Board, name: str, reason: str) -> Wire:
    stated = board.settings.buses[name]
    return Wire(name, stated.device, round(stated.speed_hz), None, reason)


def _identifying(bus: I2cBus, device: Device) -> Sequence[Message]:
    """Ask a chip who it is; return what comes before the reading in the transaction that did.

    Raises HalError if it is another chip or none, SettingError if no driver here can tell.
    """
    for entry_point in installed(CHIPS):
        identity = None
        with suppress(Exception):  # another package's module can raise anything: `probe` says so
            identity = entry_point.load().identity
        if identity is not None and identity.chip == device.chip:
            noting = _NotingReads(bus)
            identity.evidence(noting, device.address)
            return noting.register
    raise SettingError("no driver here recognises it", where=device.key)


class _NotingReads(I2cBus):
    """Passes everything on, and keeps what came before the first reading."""

    def __init__(self, bus: I2cBus) -> None:
        self.name = bus.name
        self._bus = bus
        self._first: Sequence[Message] | None = None

    @property
    def register(self) -> Sequence[Message]:
        """Messages before the first reading."""
        if self._first is None:
            raise NoAcknowledge("its identity is not read", where=self.name)
        return self._first

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Carry it out."""
        if self._first is None and isinstance(messages[-1], int):
            self._first = tuple(messages[:-1])
        return self._bus.transaction(address, messages)


class Bearable(Struct, frozen=True):
    """The shortest period that this computer bears, and what it is bound by."""

    prediction: Prediction
    shortest_ns: int
    reason: str

    @property
    def is_longer(self) -> bool:
        """Return whether the board's own period is shorter."""
        period_ns = self.prediction.period_ns
        return period_ns is not None and self.shortest_ns > period_ns

    @property
    def sentence(self) -> str:
        """Return it in words; of a board without a period there are its steps only."""
        said, period_ns = self.prediction.sentence(), self.prediction.period_ns
        if period_ns is None:
            return said
        shortest = f"the shortest period borne is {self.shortest_ns / MILLISECOND:.3g} ms"
        return f"{said}\n  {shortest}, {self.reason}; stated: {period_ns / MILLISECOND:g} ms"


def bearable(board: Board) -> Bearable:
    """Run a board on its doubles in real time; return the shortest period that this computer bears.

    Raises ConfigError for a board without doubles, and where too few steps happen in a minute.
    """
    prediction = predicted(board, _own_times(board))
    period_ns = prediction.period_ns or 0
    fullest = max((load.utilisation for load in board.loads.values()), default=0.0)
    bounds: Mapping[str, int] = {
        "in which a step is to be over": prediction.response_ns,
        "of which lateness is to be a tenth at most": ON_TIME * prediction.lateness_ns,
        f"of which a bus is to be busy {REFUSED_ABOVE_PERCENT} % at most": round(
            100 * fullest * period_ns / REFUSED_ABOVE_PERCENT
        ),
    }
    reason = max(bounds, key=bounds.__getitem__)
    return Bearable(prediction, bounds[reason], reason)


def _own_times(board: Board) -> Statistics:
    """Return statistics of a run on doubles in real time, of steps enough."""
    with closing(start_session(board, MonotonicClock(), doubles=True, statistics_path=None)) as run:
        until = 0
        while until < LONGEST and not run.executive.is_over:
            until += STRETCH
            run.run_on(until)
            if run.executive.statistics.step_times().samples >= 2 * LEAST_STEPS:
                break
        run.end()
        return run.executive.statistics
