"""The black box of a run: opened when its robot has been put together, before its chips are asked.

Imported only by runs that are recorded.
"""

import os
from collections.abc import Callable
from pathlib import Path
from time import monotonic_ns, time_ns

from msgspec import to_builtins
from msgspec.structs import asdict

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, text_of
from firmware_runtime.executive.accounting import counts_of
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.recording.blackbox.layout import size_for
from firmware_runtime.recording.blackbox.locations import persist, place_for
from firmware_runtime.recording.blackbox.ring import Ring
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import Kind, encode
from firmware_runtime.recording.blackbox.state_of_run import state_of_run
from firmware_runtime.recording.blackbox.taps import output_ports
from firmware_runtime.recording.recorded_board import recorded_board
from firmware_runtime.runs.hardware import RecordedRobot

_LONGER = 4
"""A run off the robot has a ring for so many times the time it is to run for: it may go on."""


def open_black_box(robot: RecordedRobot, path: Path, log: Callable[[str], None]) -> None:
    """Let what the recorder notes go into a recording, a new one once the run begins.

    A robot runs without one where it cannot be made; `log` gets why.
    """
    recorder, executive, board = robot.recorder, robot.executive, robot.board
    keep(board, path, log)  # of the run before, if that was killed
    is_real_time = isinstance(executive.clock, MonotonicClock)

    def ring() -> Ring | None:
        try:
            header = encoded_header(header_of(robot))
            minutes = board.settings.recording.minutes
            if place_for(path, board.name) is None:
                size = size_for(board.loads.values(), minutes)
                return Ring(path, size, header)
            span = _LONGER * recorder.until / (60 * SECOND)
            return _smaller_ring(board, path, min(minutes, span), header)
        except Exception as error:  # noqa: BLE001 -- a recording never harms a run
            log(f"warning: this run is not recorded: {text_of(error)}")
            return None

    recorder.write_into(
        ring,
        executive.simulator.atomics,
        lambda: state_of_run(
            robot.robot,
            robot.lines,
            executive.state,
            recorder.own,
            [robot.rig],
            chance=recorder.chance,
        ),
        lambda: counts_of(executive.accounts, executive.faults),
        is_real_time=is_real_time,
    )
    recorder.warn(log)


def _smaller_ring(board: Board, path: Path, minutes: float, header: bytes) -> Ring:
    """A ring for so many minutes, or for fewer where there is no room for it."""
    while True:
        size = size_for(board.loads.values(), minutes)
        try:
            return Ring(path, size, header)
        except ConfigError:
            if size == size_for((), 0):
                raise
            minutes /= 2


def keep(board: Board, recording: Path, log: Callable[[str], None]) -> None:
    """Copy what a run has recorded to the disk, where it is not kept otherwise."""
    folder = place_for(recording, board.name)
    if folder is None:
        return
    try:
        persist(recording, folder, round(board.settings.recording.keep_mib * (1 << 20)))
    except (OSError, FirmwareRuntimeError) as error:
        log(f"warning: the recording is not kept in {folder}: {text_of(error)}")


def header_of(robot: RecordedRobot) -> Header:
    """Return the header of a recording."""
    board, executive, recorder, end = robot.board, robot.executive, robot.recorder, robot.end
    atomics = executive.simulator.atomics
    own = (each for each in atomics if each in recorder.own)
    recorded = asdict(recorded_board(board, own, executive.clock))
    name = board.name if end is None else end.name
    return Header(
        **(recorded | {"board": name}),
        run=f"{name}-{monotonic_ns():x}-{os.getpid()}",
        began=(monotonic_ns(), time_ns()),
        role=None if end is None else end.role,
        has_world=robot.rig is not None,
        speed=executive.clock.speed,
        lines=recorder.lines,
        early=recorder.early,
        ports=[below_root(port.path) for port in output_ports(atomics)],
        world=[below_root(each.path) for each in atomics if each not in recorder.own],
        chance=recorder.chance,
    )


def encoded_header(header: Header) -> bytes:
    """The section that begins each chunk."""
    extra = to_builtins(header, builtin_types=[bytes])
    return encode((Kind.HEADER.value, 0, [], [], [], [], [], [], [], extra))
