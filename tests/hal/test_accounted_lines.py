"""Buses and ports with accounts: attempts, bytes, time and what is retried."""

from collections.abc import Callable, Sequence
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.hal.accounted_bus import ONE_ATTEMPT, AccountedBus, BusCounters, RetryPolicy
from firmware_runtime.hal.accounted_port import AccountedPort
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.unopened_lines import AbsentPort, NotingBus, NotingPort
from firmware_runtime.hal.wire_errors import (
    ArbitrationLost,
    BusFault,
    BusTimeout,
    HalError,
    NoAcknowledge,
    PortClosed,
)
from sim_doubles.clock import FollowingClock, ManualClock

BUS_HZ = 400_000
BIT_NS = 2_500


class ScriptedBus(I2cBus):
    """Answers each attempt with the next outcome of its script."""

    name = "i2c-1"

    def __init__(self, *outcomes: bytes | HalError) -> None:
        self.outcomes = list(outcomes)
        self.attempts: list[tuple[int, tuple[Message, ...]]] = []
        self.closed = False

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        self.attempts.append((address, tuple(messages)))
        outcome = self.outcomes.pop(0)
        if isinstance(outcome, HalError):
            raise outcome
        return outcome

    def close(self) -> None:
        self.closed = True


def numbers(counters: BusCounters) -> tuple[int, int, int, int, int]:
    return (
        counters.transactions,
        counters.bytes,
        counters.errors,
        counters.retries,
        counters.busy_ns,
    )


@pytest.mark.parametrize(
    ("outcome", "answer", "size"), [(b"\x0a", True, 2), (NoAcknowledge("n"), False, 1)]
)
@pytest.mark.parametrize("noted", [None, []])
def test_whether_something_acknowledges_is_asked_once_and_no_error(
    outcome: bytes | HalError, noted: list[tuple[object, ...]] | None, *, answer: bool, size: int
) -> None:
    scripted = ScriptedBus(outcome)
    bus = AccountedBus(scripted, BUS_HZ)
    if noted is not None:
        noted.clear()
        bus.record(3, noted, lambda: 7)
    assert bus.acknowledges(0x70) is answer
    assert scripted.attempts == [(0x70, (1,))]
    if noted is not None:
        ended = outcome if answer else ("NoAcknowledge", "n")
        assert noted == [(3, 0x70, (1,), ended, 7)]
    assert numbers(bus) == numbers(bus.by_address[0x70])
    assert numbers(bus) == (1, size, 0, 0, (9 * size + 2) * BIT_NS)
    assert bus.elapsed() == 0, "of no run it is never ahead"
    with pytest.raises(BusTimeout):
        AccountedBus(ScriptedBus(BusTimeout("stuck")), BUS_HZ).acknowledges(0x70)


@pytest.mark.parametrize("returns_early", [True, False])
def test_a_bus_that_returns_early_is_taken_to_go_on_from_its_answer(*, returns_early: bool) -> None:
    """Any other has moved the time itself, or real time has passed.

    When it began lies between question and answer; later is the safe side for who waits.
    """
    time = FollowingClock(ManualClock(1000))

    class Bus(ScriptedBus):
        def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
            time.reach(time() + 200)
            return super().transaction(address, messages)

    if returns_early:
        Bus.returns_early = True
    bus = AccountedBus(Bus(b"\x71", b"\x00"), BUS_HZ, overhead_ns=30_000, time=time)
    bus.write_read(0x68, b"\x75", 1)
    assert bus.busy_ns == 39 * BIT_NS + 30_000
    assert bus.elapsed() == time() - 1000 == 200 + (bus.busy_ns if returns_early else 0)
    bus.acknowledges(0x68)
    assert bus.busy_ns == 59 * BIT_NS + 60_000
    assert bus.elapsed() == time() - 1000 == 400 + (bus.busy_ns if returns_early else 0)


def test_transactions_pass_through_unchanged_and_each_address_has_counters_of_its_own() -> None:
    inner = ScriptedBus(b"", b"", b"\x71")
    bus = AccountedBus(inner, BUS_HZ)
    bus.write(0x40, b"\xfd\x10")
    bus.write(0x40, b"\xfd\x10")
    assert bus.write_read(0x68, b"\x75", 1) == b"\x71"
    assert inner.attempts == [(0x40, (b"\xfd\x10",))] * 2 + [(0x68, (b"\x75", 1))]
    assert numbers(bus.by_address[0x40]) == (2, 6, 0, 0, 58 * BIT_NS)
    assert numbers(bus.by_address[0x68]) == (1, 4, 0, 0, 39 * BIT_NS)
    assert numbers(bus) == (3, 10, 0, 0, 97 * BIT_NS)
    assert bus.name == "i2c-1"
    bus.close()
    assert inner.closed
    assert bus.transactions == 3


@pytest.mark.parametrize("error", [NoAcknowledge("n"), ArbitrationLost("a"), BusFault("f")])
def test_a_passing_error_is_retried_and_counted_with_the_adapters_overhead(error: HalError) -> None:
    inner = ScriptedBus(error, error, b"\x71")
    bus = AccountedBus(inner, BUS_HZ, overhead_ns=30_000)
    assert bus.write_read(0x68, b"\x75", 1) == b"\x71"
    assert inner.attempts == [(0x68, (b"\x75", 1))] * 3
    assert numbers(bus) == (1, 12, 2, 2, 117 * BIT_NS + 90_000)
    assert numbers(bus.by_address[0x68]) == numbers(bus)


@pytest.mark.parametrize(
    ("outcomes", "policy"),
    [
        pytest.param(
            (NoAcknowledge("first"), BusFault("second"), NoAcknowledge("third")),
            RetryPolicy(3),
            id="the last attempt's",
        ),
        pytest.param((BusTimeout("stuck"),), RetryPolicy(3), id="a lasting one, at once"),
        pytest.param((PortClosed("closed"),), RetryPolicy(3), id="a closed port's, at once"),
        pytest.param((NoAcknowledge("n"),), ONE_ATTEMPT, id="one attempt's, without a retry"),
    ],
)
def test_the_error_that_is_raised(outcomes: tuple[HalError, ...], policy: RetryPolicy) -> None:
    bus = AccountedBus(ScriptedBus(*outcomes), BUS_HZ, policy)
    with pytest.raises(HalError) as caught:
        bus.read(0x68, 1)
    assert caught.value is outcomes[-1]
    found = (bus.transactions, bus.errors, bus.retries)
    assert found == (1, len(outcomes), len(outcomes) - 1)


def test_a_bug_in_the_bus_underneath_is_not_retried_and_frees_the_lock() -> None:
    bus = AccountedBus(ScriptedBus(), BUS_HZ)
    for _ in range(2):
        with pytest.raises(IndexError):
            bus.read(0x68, 1)


@pytest.mark.parametrize(
    ("attempts", "on", "fault"),
    [
        *(
            (3, on, "BusTimeout is never retried")
            for on in ((BusTimeout,), (HalError,), (NoAcknowledge, BusTimeout))
        ),
        (0, (NoAcknowledge,), "0 attempts, expected 1 or more"),
    ],
)
def test_a_policy_that_cannot_be_is_refused(
    attempts: int, on: tuple[type[HalError], ...], fault: str
) -> None:
    with pytest.raises(ValueError, match=fault):
        RetryPolicy(attempts, on)


KINDS: list[Callable[[str], HalError]] = [NoAcknowledge, ArbitrationLost, BusFault, BusTimeout]
OUTCOMES = st.lists(st.one_of(st.just(b""), st.sampled_from(KINDS).map(lambda kind: kind("x"))))


@given(OUTCOMES, st.integers(1, 4))
def test_attempts_and_failures_balance(outcomes: list[bytes | HalError], attempts: int) -> None:
    inner = ScriptedBus(*outcomes, *[b""] * 5)
    bus = AccountedBus(inner, BUS_HZ, RetryPolicy(attempts))
    failed = 0
    while len(inner.outcomes) >= 5:
        try:
            bus.write(0x40 + len(inner.outcomes) % 3, b"\x00")
        except HalError:
            failed += 1
    assert len(inner.attempts) == bus.transactions + bus.retries
    assert failed == bus.errors - bus.retries
    sums = zip(*map(numbers, bus.by_address.values()), strict=True)
    assert numbers(bus) == tuple(map(sum, sums))


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
    step.advance(1_000_000_000)
    lines.reach(step() + 700)
    assert port.elapsed() == 700, "idle, it is where the other lines are"


def test_bytes_pass_through_unchanged_and_are_counted_with_the_time_they_take() -> None:
    inner = Port()
    port = AccountedPort(inner, BAUD, FollowingClock(ManualClock()))
    port.write(b"abc" * 4)
    port.write(b"abc")
    assert (port.name, port.writes, port.bytes_written, port.bytes_read) == ("treads", 2, 15, 0)
    assert 0 <= port.writing_ns - 15 * BYTE < 2
    assert port.read_available() == b"abc" * 5
    assert port.read_available() == b""
    assert (port.bytes_read, port.errors) == (15, 0)
    assert 0 <= port.reading_ns - 15 * BYTE < 2
    port.write(b"old")
    port.discard_input()
    assert inner.written == b""
    port.close()
    assert inner.closed


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


def test_lines_that_are_not_opened_note_what_would_be_written() -> None:
    notes: list[str] = []
    bus, port = NotingBus("i2c1", "i2c1", notes), NotingPort("treads", "treads", notes)
    assert bus.transaction(0x40, (b"\xfd\x10",)) == b""
    assert bus.transaction(0x40, (b"\x00", 2)) == bytes(2)
    port.write(b"\x80\x00")
    assert port.read_available() == b""
    assert notes == ["i2c1 0x40: fd10", "treads: 8000"]
