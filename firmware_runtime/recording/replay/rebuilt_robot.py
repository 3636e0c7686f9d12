"""The robot of a recording, built again on lines that answer as they did then."""

import builtins
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, TypeAlias

import msgspec
from msgspec.structs import replace

from firmware_runtime.board.configuration import configuration_of
from firmware_runtime.board.ends import end_of, robot_of
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.board.rigs import rig_for
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import OutPort, Sent
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.executive.account import Step
from firmware_runtime.executive.clocks import MonotonicClock, VirtualClock, WorldClock
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.progress import Progress
from firmware_runtime.hal import wire_errors as errors
from firmware_runtime.hal.accounted_bus import AccountedBus, RetryPolicy
from firmware_runtime.hal.accounted_port import AccountedPort
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import HalError, NoAcknowledge
from firmware_runtime.links.dover.dover import DoverBlocks
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import DISCARD, READ, WRITE, Transfer
from firmware_runtime.recording.blackbox.state.walk import ForeignState
from firmware_runtime.recording.blackbox.state_of_run import begin_late, put
from firmware_runtime.recording.blackbox.taps import output_ports, own_atomics, tap_outputs
from firmware_runtime.recording.replay.feed import Feed

_ERRORS: Final = {
    name: kind
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, HalError)
}
"""Errors that a driver expects of a line. Any other was the world's behind a double."""


def replayed_lines(board: Board, feed: Feed, early: Sequence[str]) -> Lines:
    """The board's lines, with retries, counters and times as in a run."""
    if not feed.lines:
        return board.absent_lines()
    time = ReplayedTime(feed)
    buses: dict[str, I2cBus] = {
        name: AccountedBus(
            ReplayedBus(name, feed, returns_early=name in early),
            round(stated.speed_hz),
            RetryPolicy(stated.attempts),
            overhead_ns=stated.overhead_ns,
            time=time,
        )
        for name, stated in board.settings.buses.items()
    }
    ports: dict[str, SerialPort] = {
        name: AccountedPort(ReplayedPort(name, feed), stated.baud, time)
        for name, stated in board.ports.items()
    }
    return Lines(buses, ports, feed.enabled)


class ReplayedBus(I2cBus):
    """A bus by its name."""

    def __init__(self, name: str, feed: Feed, *, returns_early: bool) -> None:
        self.name = name
        self.returns_early = returns_early
        self._feed = feed
        self._number = _number(feed, name)

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Answer as the recorded one did, by bytes or by its error."""
        recorded = self._feed.transfer(self._number, address, list(messages))
        if recorded is not None:
            return _answer(recorded)
        wanted = sum(each for each in messages if isinstance(each, int))
        if wanted:
            where = f"{self.name} address 0x{address:02x}"
            raise NoAcknowledge("the recording has no such reading here", where=where)
        return b""

    def pause(self, span: int) -> None:
        """Let no time pass: what passed was recorded."""


class ReplayedPort(SerialPort):
    """A serial port by its name."""

    def __init__(self, name: str, feed: Feed) -> None:
        self.name = name
        self._feed = feed
        self._number = _number(feed, name)

    def write(self, data: bytes) -> None:
        """Take what was written then."""
        self._used(WRITE, bytes(data))

    def read_available(self) -> bytes:
        """Return what had arrived then."""
        return self._used(READ, b"")

    def discard_input(self) -> None:
        """Throw away what was thrown away then."""
        self._used(DISCARD, b"")

    def close(self) -> None:
        """There is nothing to release."""

    def _used(self, what: int, data: bytes) -> bytes:
        recorded = self._feed.transfer(self._number, what, data)
        return b"" if recorded is None else _answer(recorded)


class ReplayedTime:
    """The time of the lines, as they said it was."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed

    def __call__(self) -> int:
        """Return the instant."""
        return self._feed.time()

    def reach(self, at: int) -> None:
        """Stay: what was reached was recorded."""

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to where the lines were."""
        return self._feed.elapsed()


REPLAYED: Final = (ReplayedBus, ReplayedPort, ReplayedTime, Feed)
"""Classes that stand where a run's lines are."""


def _number(feed: Feed, name: str) -> int:
    return feed.lines.index(name) if name in feed.lines else -1


def _answer(recorded: Transfer) -> bytes:
    if not recorded.failed:
        answer: bytes = recorded.answer
        return answer
    name, sentence = recorded.answer
    raise _error(name, sentence)


def _error(name: object, sentence: object) -> Exception:
    """Return the error that a line raised: a HalError, Python's, or else one of this name."""
    kind: object = _ERRORS.get(name) or vars(builtins).get(name) if isinstance(name, str) else None
    if not (isinstance(kind, type) and issubclass(kind, Exception)):
        is_name = isinstance(name, str) and name.isidentifier()
        kind = type(str(name), (Exception,), {}) if is_name else ModelError
    try:
        error: Exception = kind(sentence)
    except TypeError:  # of some of Python's it takes more than a sentence
        return ModelError(sentence)
    return error


class PlayedWorld:
    """Tap of a replay: where a run's notes what a world does, this one plays it.

    It stands in the place of models that are none of the robot's own. `sent` is what the replay has
    sent so far in the section, so it says where in the recorded one the next value stands.
    """

    def __init__(self, own: frozenset[Atomic], feed: Feed, sent: Sent) -> None:
        self._own = own
        self._feed = feed
        self._sent = sent

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """A model of the robot's as it is, one of a world played."""
        if atomic in self._own:
            return functions
        internal = partial(self._transit, atomic)
        confluent = None if functions.confluent is None else partial(internal)
        external = partial(self._reached, atomic)
        return Wrapped(atomic, partial(self._output, atomic), internal, external, confluent)

    def watch(self, step: Step) -> None:
        """Note nothing: the readings are the recorded ones."""

    def _output(self, atomic: Atomic) -> None:
        ports = {port.number: port for port in atomic.out_ports.values()}
        for _ in range(self._feed.world(0)):
            recorded = self._feed.world_sent(len(self._sent) // 2, ports)
            if recorded is None:
                return
            number, form = recorded
            port = ports[number]
            port.send(_value(form, port.type))

    def _transit(self, atomic: Atomic) -> None:
        atomic.sigma = self._feed.world(NEVER)

    def _reached(self, atomic: Atomic, elapsed: int) -> None:
        left = NEVER if atomic.sigma == NEVER else max(0, atomic.sigma - elapsed)
        atomic.sigma = self._feed.world(left)


def _value(form: object, kind: type[object]) -> object:
    """The value that was written in this form; the form itself where no such value can be made."""
    with suppress(msgspec.ValidationError, TypeError):
        return msgspec.convert(form, kind)
    return form


def foreign_keyframe(error: ForeignState, code_changed: Sequence[str]) -> ConfigError:
    """Mostly the code is another, in these modules; else it is said what cannot be set back."""
    fault = "its models are not those of the recording's keyframes"
    if not (error.is_of_another_robot or code_changed):
        fault = f"a keyframe of the recording cannot be set back ({text_of(error)})"
    expected = "expected the code of the run, or to begin where the recording does, at its start"
    return ConfigError.of_one("replay", f"{fault}; {expected}")


Port: TypeAlias = OutPort[object]


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
    tap: Any = PlayedWorld(own, feed, sent)
    configuration = replace(configuration_of(board, robot.model, lines, elsewhere), tap=tap)
    profiler = Profiler(robot.model, feed.reading, configuration, stands_still=feed.is_virtual)
    atomics = profiler.simulator.atomics
    numbers, ports = _numbered(header.ports, output_ports(atomics))
    tap_outputs(atomics, sent, numbers)
    file = profiler.open_file({"clock_speed": header.speed, "until_ns": 0, "conditions": {}}, None)
    progress = Progress(profiler.step, configuration.max_lag, header.speed)
    ledger = Ledger(file, profiler, Inbox(feed.reading), VirtualClock(), progress)
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
