"""Lines of a replay: they answer as the recorded ones did."""

import builtins
from collections.abc import Sequence
from typing import Final

from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Lines
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.hal import wire_errors as errors
from firmware_runtime.hal.accounted_bus import AccountedBus, RetryPolicy
from firmware_runtime.hal.accounted_port import AccountedPort
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import HalError, NoAcknowledge
from firmware_runtime.recording.blackbox.section import DISCARD, READ, WRITE, Transfer
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
