"""A run on smbus2's calls of the kernel and on a pseudo-terminal is its replay, failures too.

The kernel under smbus2 is `sim_doubles.smbus`: a bus of doubles that answers its ioctls. On
`/dev/i2c-N` of a module of the kernel the same is a test of its own, where there is one.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.hal import linux
from firmware_runtime.hal.linux_serial import open_serial
from firmware_runtime.hal.wire_errors import EREMOTEIO
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.runs import hardware
from firmware_runtime.runs.open_lines import open_lines
from firmware_runtime.runs.start import start_session
from sim_doubles.faults import AdapterError, FaultScript
from sim_doubles.plugged import plug
from sim_doubles.rigs.board_rig import rig_for
from sim_doubles.serial_pty import SerialPty
from sim_doubles.smbus import SMBus, ioctl
from tests.support.replayed import check_identical
from tests.support.served_rig import SERIAL_SONAR

pytestmark = [pytest.mark.slow, pytest.mark.real_time]
UNPLUGGED_AT = 600 * MILLISECOND


@dataclass
class RealLines:
    """What is behind the lines of the run: doubles, and the end of the pseudo-terminal."""

    rig: Any = None
    pty: SerialPty | None = None


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> Iterator[RealLines]:
    """Runs in this process drive a bus through smbus2, and ports through pyserial."""
    found = RealLines()
    with ExitStack() as stack:

        def opened(board: Any, _doubles: None, interlock: Any, time: Any, recorder: Any) -> Any:  # noqa: ANN401
            found.rig = rig = rig_for(board, time)
            (bus,) = rig.buses.values()
            monkeypatch.setattr(linux, "ioctl", ioctl)
            stack.enter_context(plug(bus.name, bus))
            buses = {name: linux.LinuxI2cBus(name, SMBus(bus.name)) for name in rig.buses}
            ports = {}
            for name, line in rig.ports.items():
                target: Any = vars(line)["_target"]
                found.pty = stack.enter_context(SerialPty(target, time))
                ports[name] = open_serial(name, found.pty.path)
            real: Any = SimpleNamespace(buses=buses, ports=ports, enable=None)
            return open_lines(board, real, interlock, time, recorder)

        monkeypatch.setattr(hardware, "open_lines", opened)
        yield found


class Between:
    """Does something between two steps, once, from an instant on."""

    def __init__(self, at: int, do: Callable[[int], None]) -> None:
        self._at = at
        self._do: Callable[[int], None] | None = do

    def between_steps(self, now: int, left: int) -> None:  # noqa: ARG002 -- a hook's
        if now >= self._at and self._do is not None:
            self._do(now)
            self._do = None


def run(path: Path, board: str, settings: tuple[str, ...], between: Between | None = None) -> None:
    """Leave a recording of 1.2 s in real time."""
    found = board_in_force(board, ("executive.fifo_priority=0", *settings))
    session = start_session(
        found, MonotonicClock(), doubles=False, statistics_path=None, recording=path
    )
    if between is not None:
        session.executive.hooks.append(between)
    try:
        session.run(1200 * MILLISECOND)
    finally:
        session.close()


@pytest.mark.parametrize("board", ["tachobot", "pan_tilt"])
def test_a_run_by_the_kernels_calls_is_its_replay_with_the_chip_gone_for_a_while(
    lines: RealLines, tmp_path: Path, board: str
) -> None:
    def chip_gone(now: int) -> None:
        gone = AdapterError(
            errno=EREMOTEIO, address=None, since=now, until=now + SECOND // 5, times=None
        )
        lines.rig.buses["i2c1"].faults = FaultScript([gone])

    path = tmp_path / "run.recording"
    run(path, board, (), Between(UNPLUGGED_AT, chip_gone))
    check_identical(path)
    failed = {each.answer[0] for each in _transfers(path) if each.failed}
    assert failed == {"NoAcknowledge"}


def test_a_port_that_is_unplugged_is_a_fault_again_in_the_replay(
    lines: RealLines, tmp_path: Path
) -> None:
    def unplug(_now: int) -> None:
        assert lines.pty is not None
        lines.pty.close()

    path = tmp_path / "run.recording"
    run(path, "detective", SERIAL_SONAR, Between(UNPLUGGED_AT, unplug))
    check_identical(path)
    of_port = [each for each in _transfers(path) if each.address < 0]
    assert b"".join(each.answer for each in of_port if not each.failed)
    assert {each.answer[0] for each in of_port if each.failed} == {"BusFault"}


def _transfers(path: Path) -> list[Any]:
    sections = (each for part in read_recording(path).segments() for each in part.sections())
    return [transfer for section in sections for transfer in section.transfers]
