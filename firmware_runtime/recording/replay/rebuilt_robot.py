"""The robot of a recording, built again on lines that answer as they did then."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from msgspec.structs import replace

from firmware_runtime.board.configuration import configuration_of
from firmware_runtime.board.ends import end_of
from firmware_runtime.board.lines import Lines
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.board.rigs import rig_for
from firmware_runtime.board.robot import Robot
from firmware_runtime.board.robot_of_end import robot_of
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.tapped_ports import Sent
from firmware_runtime.executive.clocks import MonotonicClock, VirtualClock, WorldClock
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.progress import Progress
from firmware_runtime.executive.untimed_ledger import open_ledger
from firmware_runtime.links.dover.blocks import DoverBlocks
from firmware_runtime.recording.blackbox.header import Header
from firmware_runtime.recording.blackbox.tapped_models import output_ports, own_atomics, tap_outputs
from firmware_runtime.recording.random_state import begin_late, put
from firmware_runtime.recording.replay.feed import Feed
from firmware_runtime.recording.replay.replayed_lines import replayed_lines
from firmware_runtime.recording.replay.replayed_world import PlayedWorld

Port: TypeAlias = OutPort[Any]


class _ReplayTap:
    """The tap of a replay: where a run's notes what enters, this one supplies it."""

    def __init__(self, world: PlayedWorld, feed: Feed) -> None:
        self.instrument = world.instrument
        self._feed = feed

    def reading(self, now: Callable[[], int]) -> Callable[[], int]:  # noqa: ARG002 -- not asked
        return self._feed.reading


@dataclass(frozen=True, slots=True)
class Rebuilt:
    """A robot ready to be replayed; `sent` gets all that leaves its ports."""

    robot: Robot
    lines: Lines
    rig: Rig | None
    """The world's models are its, and play what they did."""
    own: frozenset[Atomic]
    profiler: Profiler
    ledger: Ledger
    sent: Sent
    ports: list[str]
    """Output ports by path below the root, by number; those the recording has not are the last."""


def rebuilt(header: Header, board: Board, feed: Feed) -> Rebuilt:
    """Build the robot by this board; the feed holds what entered while it was built then.

    The process's own generators of random numbers stand where they stood then. Raises ConfigError
    for a board that the recording is none of.
    """
    begin_late(header.chance)
    put(header.chance)
    lines = replayed_lines(board, feed, header.early)
    whole = board.build(lines)
    own = frozenset(own_atomics(whole.model))
    rig = rig_for(board, WorldClock()) if header.has_world else None
    if rig is not None:
        rig.attach(whole.model)
    elsewhere: tuple[str, ...] = ()
    robot = whole
    if header.role is not None:
        end = end_of(board, header.role)
        robot, _ = robot_of(end, whole)
        elsewhere = end.elsewhere
    clock = VirtualClock() if feed.is_virtual else MonotonicClock()
    DoverBlocks(robot.model, clock)
    sent: Sent = []
    tap: Any = _ReplayTap(PlayedWorld(own, feed, sent), feed)
    configuration = replace(configuration_of(board, robot.model, lines, elsewhere), tap=tap)
    profiler = Profiler(
        robot.model, feed.reading, configuration, stands_still=not header.takes_time
    )
    atomics = profiler.simulator.atomics
    numbers, ports = _numbered(header.ports, output_ports(atomics))
    tap_outputs(atomics, sent, numbers)
    file = profiler.open_file({"clock_speed": header.speed, "until_ns": 0, "conditions": {}}, None)
    progress = Progress(profiler.step, configuration.max_lag, header.speed)
    ledger = open_ledger(file, profiler, Inbox(feed.reading), VirtualClock(), progress)
    return Rebuilt(robot, lines, rig, own, profiler, ledger, sent, ports)


def _numbered(recorded: Sequence[str], ports: Sequence[Port]) -> tuple[list[int], list[str]]:
    """The number of each port, and the paths by number: one that was recorded keeps its own."""
    paths = list(recorded)
    known = {path: number for number, path in enumerate(recorded)}
    numbers: list[int] = []
    for port in ports:
        path = below_root(port.path)
        if path not in known:
            known[path] = len(paths)
            paths.append(path)
        numbers.append(known[path])
    return numbers, paths
