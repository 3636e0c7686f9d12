"""Transactions that switch a recorded robot off: they are answered wherever they come.

No motor is behind a recording, and a run that ends earlier or later than the recorded one has to be
able to say that it is off. What switching off asks for is known from the robot itself, built on
lines that carry nothing, also after a failure there; and from where the run switched off, which is
all where the robot's package is not installed. A read among it gets what that read got last in the
run, or zeros.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TypeAlias

from firmware_runtime.board.robot import Lines
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusFault
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import WRITE, Kind
from firmware_runtime.recording.board_of_recording import board_of

Key: TypeAlias = tuple[str, int, tuple[Message, ...] | bytes]
"""Line, address and messages; of a port what was done, and its bytes."""
Stops: TypeAlias = Mapping[Key, bytes]
"""Answer to each transaction of switching off."""


def key_of(line: str, address: int, messages: Sequence[Message] | bytes) -> Key:
    """Return the key of a transaction."""
    return line, address, messages if isinstance(messages, bytes) else tuple(messages)


def stops_of(recording: Recording) -> Stops:
    """All that switching off the robot of a recording asks for."""
    header = recording.header
    answers: dict[Key, bytes] = {}
    then: dict[Key, bytes] = {}
    for segment in recording.segments():
        for section in segment.sections():
            for each in section.transfers:
                if not each.failed:
                    key = key_of(header.lines[each.line], each.address, each.messages)
                    answers[key] = each.answer
                    if section.kind is Kind.SAFE and (each.address >= 0 or each.address == WRITE):
                        then[key] = each.answer
    with suppress(ConfigError):  # its package is not installed here, or has other settings
        return {**then, **_asked_by_robot(header, answers)}
    return then


def _asked_by_robot(header: Header, answers: Mapping[Key, bytes]) -> dict[Key, bytes]:
    """Raises ConfigError if the robot cannot be built."""
    board = board_of(header)
    stopping = _Stopping(answers)
    buses: dict[str, I2cBus] = {name: _Bus(name, stopping) for name in board.settings.buses}
    ports: dict[str, SerialPort] = {name: _Port(name, stopping) for name in board.ports}
    robot = board.build(Lines(buses, ports))
    stopping.asked.clear()
    for stopping.fails in (False, True, False):
        robot.make_safe()
    return stopping.asked


class _Stopping:
    """Answers as the run's lines did last, and keeps what was asked for."""

    def __init__(self, answers: Mapping[Key, bytes]) -> None:
        self.asked: dict[Key, bytes] = {}
        self.fails = False
        self._answers = answers

    def answer(self, key: Key, length: int) -> bytes:
        """Raises BusFault where it is to fail."""
        answer = self.asked[key] = self._answers.get(key, bytes(length))
        if self.fails:
            raise BusFault("fails, so that what follows a failure is seen", where=key[0])
        return answer


class _Bus(I2cBus):
    def __init__(self, name: str, stopping: _Stopping) -> None:
        self.name = name
        self._stopping = stopping

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        length = sum(each for each in messages if isinstance(each, int))
        return self._stopping.answer(key_of(self.name, address, messages), length)

    def pause(self, span: int) -> None:
        """Let no time pass."""


class _Port(SerialPort):
    def __init__(self, name: str, stopping: _Stopping) -> None:
        self.name = name
        self._stopping = stopping

    def write(self, data: bytes) -> None:
        self._stopping.answer(key_of(self.name, WRITE, bytes(data)), 0)

    def read_available(self) -> bytes:
        return b""

    def close(self) -> None:
        """There is nothing to release."""
