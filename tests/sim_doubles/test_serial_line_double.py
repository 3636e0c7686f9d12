"""Serial lines of doubles: in process by bytes, and on a real pseudo-terminal through pyserial."""

import os
import select
from collections.abc import Iterator

import pytest
import serial

from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.strike import Span
from firmware_runtime.hal.wire_errors import BusFault, PortClosed
from sim_doubles.clock import ManualClock
from sim_doubles.serial_line import SerialLineDouble, SerialTarget
from sim_doubles.serial_pty import PtySerialLine, SerialPty
from tests.support.waiting import PATIENCE_S

MILLISECOND = 1_000_000
EVERY_BYTE = bytes(range(256))


class Echo(SerialTarget):
    """Sends back what it got, 1 ms later."""

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.got = b""
        self.waiting: list[tuple[int, bytes]] = []
        self.power_cycles = 0

    def receive(self, data: bytes) -> None:
        self.got += data
        self.waiting.append((self.clock() + MILLISECOND, data))

    def transmitted(self, at: int) -> bytes:
        due = [data for due_at, data in self.waiting if due_at <= at]
        del self.waiting[: len(due)]
        return b"".join(due)

    def power_cycle(self) -> None:
        self.waiting.clear()
        self.power_cycles += 1


@pytest.fixture
def echo(clock: ManualClock) -> Echo:
    return Echo(clock)


@pytest.fixture
def line(clock: ManualClock, echo: Echo) -> SerialLineDouble:
    return SerialLineDouble("sonar", clock, echo)


@pytest.fixture
def pty_line(clock: ManualClock, echo: Echo) -> Iterator[PtySerialLine]:
    line = PtySerialLine(echo, clock)
    yield line
    line.close()


def wait_for_host(line: PtySerialLine) -> None:
    """Wait until what the host wrote is there to pump."""
    assert select.select([line], [], [], 5.0)[0]


def test_bytes_go_to_the_target_and_come_back_in_their_time_and_are_logged(
    clock: ManualClock, echo: Echo
) -> None:
    echo.receive(b"old")  # lost, as it was sent before opening
    clock.advance(MILLISECOND)
    line = SerialLineDouble("sonar", clock, echo)
    assert line.read_available() == b""
    begun = clock()
    line.write(b"\x80\x00")
    assert echo.got == b"old\x80\x00"
    clock.advance(MILLISECOND - 1)
    assert line.read_available() == b""
    clock.advance(1)
    assert line.read_available() == b"\x80\x00"
    assert line.read_available() == b""
    assert [(entry.at - begun, str(entry)) for entry in line.log] == [
        (0, "W 80 00"),
        (MILLISECOND, "R 80 00"),
    ]
    line.write(b"old")
    clock.advance(MILLISECOND)
    line.discard_input()
    assert line.read_available() == b""
    line.write(b"x")
    line.close()
    with pytest.raises(PortClosed, match="sonar: used after it was closed"):
        line.read_available()
    with pytest.raises(PortClosed):
        line.write(b"y")
    clock.advance(MILLISECOND)
    assert echo.transmitted(clock()) == b"x", "the target goes on"


def test_an_unplugged_adapter_fails_every_use_until_it_is_back(
    line: SerialLineDouble, echo: Echo
) -> None:
    line.unplugged = True
    with pytest.raises(BusFault, match="sonar: the adapter is gone"):
        line.write(b"x")
    with pytest.raises(BusFault):
        line.read_available()
    line.unplugged = False
    line.write(b"y")
    assert echo.got == b"y"


def test_a_cut_line_loses_bytes_both_ways_without_a_word(
    line: SerialLineDouble, clock: ManualClock, echo: Echo
) -> None:
    line.write(b"a")
    clock.advance(MILLISECOND)
    line.cut()
    line.write(b"b")
    echo.receive(b"c")
    clock.advance(MILLISECOND)
    assert line.read_available() == b"a"
    line.reconnect()
    line.write(b"d")
    clock.advance(MILLISECOND)
    assert line.read_available() == b"d"
    assert echo.got == b"acd"


def test_a_silence_that_is_given_an_end_takes_what_is_sent_at_that_instant(
    line: SerialLineDouble, clock: ManualClock, echo: Echo
) -> None:
    line.strike("silent", None, Span(clock(), NEVER, once=False), 0.0)
    echo.receive(b"a")
    line.end_strikes(clock() + MILLISECOND)
    clock.advance(2)
    echo.receive(b"b")
    clock.advance(MILLISECOND)
    assert line.read_available() == b"b"


@pytest.mark.parametrize(
    ("span", "is_silent"),
    [
        (Span(0, 10 * MILLISECOND, once=False), [True, True, False]),
        (Span(0, NEVER, once=False), [True, False, False]),
        (Span(2 * MILLISECOND, NEVER, once=False), [True, False, False]),
    ],
    ids=["with an end of its own", "without", "without, from later on"],
)
def test_only_a_silence_without_an_end_is_given_one(
    line: SerialLineDouble, clock: ManualClock, echo: Echo, span: Span, is_silent: list[bool]
) -> None:
    line.strike("silent", None, span, 0.0)
    line.end_strikes(4 * MILLISECOND)
    heard = []
    for at in (3, 7, 12):
        clock.advance(at * MILLISECOND - clock())
        line.read_available()
        echo.receive(b"a")
        clock.advance(MILLISECOND)
        heard.append(line.read_available() == b"")
    assert heard == is_silent


def test_what_was_sent_in_a_silence_does_not_arrive_after_it_was_cleared(
    line: SerialLineDouble, clock: ManualClock, echo: Echo
) -> None:
    line.strike("silent", None, Span(clock(), NEVER, once=False), 0.0)
    echo.receive(b"a")
    clock.advance(MILLISECOND)
    line.clear_strikes()
    echo.receive(b"b")
    clock.advance(MILLISECOND)
    assert line.read_available() == b"b"


@pytest.mark.parametrize(
    ("kinds", "arrived"),
    [
        (("drop",), b"bcdabcd"),
        (("drop", "drop"), b"cdabcd"),
        (("garble",), b"\x9ebcdabcd"),
        (("drop", "garble"), b"\x9dcdabcd"),
    ],
)
def test_a_byte_that_is_lost_or_garbled_is_one_byte(
    line: SerialLineDouble, echo: Echo, kinds: tuple[str, ...], arrived: bytes
) -> None:
    for kind in kinds:
        line.strike(kind, None, Span(0, 0, once=True), 0.0)
    line.write(b"abcd")
    line.write(b"abcd")
    assert echo.got == arrived


def test_what_had_no_supply_for_a_while_comes_back_as_powered_up(
    clock: ManualClock, line: SerialLineDouble, echo: Echo
) -> None:
    line.strike("absent", None, Span(0, MILLISECOND, once=False), 0.0)
    echo.receive(b"what it kept while it was off")
    clock.advance(2 * MILLISECOND)
    assert line.read_available() == b""
    line.write(b"on")
    clock.advance(MILLISECOND)
    assert line.read_available() == b"on"
    assert echo.power_cycles == 2, "one as its supply fails, and one as it is back"


def test_every_byte_passes_a_pseudo_terminal_both_ways_unchanged(
    pty_line: PtySerialLine, clock: ManualClock, echo: Echo
) -> None:
    with serial.Serial(pty_line.path, 9600, timeout=PATIENCE_S) as port:
        port.write(EVERY_BYTE)
        wait_for_host(pty_line)
        pty_line.pump()
        assert echo.got == EVERY_BYTE
        clock.advance(MILLISECOND)
        pty_line.pump()
        assert port.read(256) == EVERY_BYTE


def test_hosts_may_come_and_go(pty_line: PtySerialLine, echo: Echo) -> None:
    pty_line.pump()
    assert echo.got == b""
    for greeting in (b"one", b"two"):
        with serial.Serial(pty_line.path, 9600) as port:
            port.write(greeting)
            wait_for_host(pty_line)
            pty_line.pump()
    assert echo.got == b"onetwo"


def test_what_is_not_fetched_is_lost_and_counted(
    pty_line: PtySerialLine, clock: ManualClock, echo: Echo
) -> None:
    for _ in range(100):
        echo.receive(bytes(10_000))
        clock.advance(MILLISECOND)
        pty_line.pump()
    assert 800_000 < pty_line.lost < 1_000_000
    closed = PtySerialLine(echo, clock)
    closed.close()
    assert not os.path.exists(closed.path)  # noqa: PTH110 (a path is a string for pyserial)


def test_a_pseudo_terminal_that_is_closed_leaves_no_descriptor_open(
    echo: Echo, clock: ManualClock
) -> None:
    before = set(os.listdir("/proc/self/fd"))  # noqa: PTH208 -- names alone
    with SerialPty(echo, clock):
        pass
    assert set(os.listdir("/proc/self/fd")) <= before  # noqa: PTH208
