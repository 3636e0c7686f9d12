from collections.abc import Callable
from functools import partial

import pytest

from firmware_runtime.hal.accounted_port import AccountedPort
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.unopened_lines import AbsentPort
from firmware_runtime.hal.wire_errors import HalError
from sim_doubles.clock import FollowingClock, ManualClock

BAUD = 9600
BYTE = 10 * 1_000_000_000 / BAUD
"""Ns; eight bits, start and stop."""


class Port(SerialPort):
    name = "treads"

    def __init__(self) -> None:
        self.written = b""
        self.closed = False

    def write(self, data: bytes) -> None:
        self.written += data

    def read_available(self) -> bytes:
        taken, self.written = self.written, b""
        return taken

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def step() -> ManualClock:
    return ManualClock()


@pytest.fixture
def lines(step: ManualClock) -> FollowingClock:
    return FollowingClock(step)


@pytest.fixture
def port(lines: FollowingClock) -> AccountedPort:
    return AccountedPort(Port(), BAUD, lines)


def test_bytes_have_left_ten_bits_each_later_and_queue_behind_those_that_have_not(
    port: AccountedPort, step: ManualClock, lines: FollowingClock
) -> None:
    assert port.elapsed() == 0
    port.write(bytes(12))
    assert 0 <= port.elapsed() - 12 * BYTE < 1
    step.advance(round(2 * BYTE))
    port.write(bytes(1))
    assert abs(port.elapsed() - 11 * BYTE) < 3
    assert lines.elapsed() == 0  # the other lines are not held up


def test_a_port_that_is_idle_is_where_the_other_lines_are(
    port: AccountedPort, step: ManualClock, lines: FollowingClock
) -> None:
    port.write(bytes(1))
    step.advance(1_000_000_000)
    lines.reach(step() + 700)
    assert port.elapsed() == 700


def test_what_it_carries_is_counted_with_the_time_it_takes(port: AccountedPort) -> None:
    port.write(bytes(12))
    port.write(bytes(3))
    assert (port.writes, port.bytes_written, port.bytes_read) == (2, 15, 0)
    assert 0 <= port.writing_ns - 15 * BYTE < 2
    assert port.read_available() == bytes(15)
    assert port.read_available() == b""
    assert (port.bytes_read, port.errors) == (15, 0)
    assert 0 <= port.reading_ns - 15 * BYTE < 2


def test_a_call_that_fails_is_an_error_and_nothing_else() -> None:
    port = AccountedPort(AbsentPort("treads"), BAUD, FollowingClock(ManualClock()))
    calls: list[Callable[[], object]] = [
        partial(port.write, b"abc"),
        port.read_available,
        port.discard_input,
    ]
    for number, call in enumerate(calls, 1):
        with pytest.raises(HalError):
            call()
        assert port.errors == number
    assert (port.writes, port.bytes_written, port.bytes_read) == (0, 0, 0)
    assert (port.writing_ns, port.reading_ns, port.elapsed()) == (0, 0, 0)


def test_bytes_pass_through_unchanged() -> None:
    inner = Port()
    port = AccountedPort(inner, BAUD, FollowingClock(ManualClock()))
    port.write(b"abc")
    assert port.name == "treads"
    assert port.read_available() == b"abc"
    port.write(b"old")
    port.discard_input()
    assert inner.written == b""
    port.close()
    assert inner.closed
