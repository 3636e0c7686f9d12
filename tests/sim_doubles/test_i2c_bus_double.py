"""The bus double on the wire: order, acknowledges, collisions, counters, errnos, time, threads."""

import errno
import sys
import threading
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.hal.budget import transaction_ns, wire_ns
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import EREMOTEIO, BusFault, NoAcknowledge, PortClosed
from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, StuckSda
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target


class Recorder(Target):
    """Answers one address, refuses the bytes in `refuses`, gives `answers` in a circle."""

    def __init__(self, address: int, answers: bytes = b"\xff", refuses: bytes = b"") -> None:
        self.address = address
        self.answers = answers
        self.refuses = refuses
        self.seen: list[str] = []

    def start(self, address: int, *, read: bool) -> bool:
        if address != self.address:
            return False
        self.seen.append("R" if read else "W")
        return True

    def write(self, byte: int) -> bool:
        self.seen.append(f"{byte:02x}")
        return byte not in self.refuses

    def read(self) -> int:
        self.seen.append("r")
        byte, self.answers = self.answers[0], self.answers[1:] + self.answers[:1]
        return byte

    def stop(self) -> None:
        self.seen.append("P")

    def power_cycle(self) -> None:
        self.seen.append("power")


def bus_of(*targets: Target, adapter: str = "bcm2835") -> I2cBusDouble:
    return I2cBusDouble("i2c-1", ManualClock(), targets, adapter=adapter)


def errno_of(bus: I2cBusDouble, address: int, *messages: bytes | int) -> int | None:
    with pytest.raises(OSError, match=r"\[Errno \d+\]") as raised:
        bus.transfer(address, messages)
    return raised.value.errno


@pytest.mark.parametrize(
    ("messages", "answer", "seen"),
    [
        ([b"\x06\x07", 3], b"\x11\x22\x11", "W 06 07 R r r r P"),
        ([1, b"\xaa", 2], b"\x11\x22\x11", "R r W aa R r r P"),
    ],
)
def test_messages_are_bytes_between_starts_with_one_stop_and_reads_joined_in_order(
    messages: list[bytes | int], answer: bytes, seen: str
) -> None:
    chip, bystander = Recorder(0x40, answers=b"\x11\x22"), Recorder(0x41)
    assert bus_of(chip, bystander, adapter="designware").transaction(0x40, messages) == answer
    assert chip.seen == seen.split()
    assert bystander.seen == ["P"]


def test_absent_address_is_no_acknowledge_and_names_bus_and_address() -> None:
    with pytest.raises(NoAcknowledge, match="i2c-1 0x68") as raised:
        bus_of(Recorder(0x40)).write(0x68, b"\x00")
    assert isinstance(raised.value.__cause__, OSError)


def test_one_target_acknowledges_for_all_and_one_that_refused_sees_no_more() -> None:
    willing, unwilling = Recorder(0x40), Recorder(0x40, refuses=b"\x01")
    bus_of(unwilling, willing).write(0x40, b"\x01\x02")
    assert willing.seen == ["W", "01", "02", "P"]
    assert unwilling.seen == ["W", "01", "P"]
    first, second = Recorder(0x40, refuses=b"\x02"), Recorder(0x40, refuses=b"\x02")
    with pytest.raises(NoAcknowledge):
        bus_of(first, second).transaction(0x40, [b"\x01\x02\x03", 1])
    assert first.seen == second.seen == ["W", "01", "02", "P"], "a byte that all refuse ends it"
    bus = bus_of(Recorder(0x70, answers=b"\xf3\x0f"), Recorder(0x70, answers=b"\x3c\xff"))
    assert bus.read(0x70, 2) == b"\x30\x0f", "reads that collide are the bitwise AND"


@pytest.mark.parametrize(
    ("messages", "size", "bits"), [([bytes(33)], 34, 308), ([b"\x3a", 23], 26, 237)]
)
def test_bits_of_bursts_are_those_of_the_data_sheets(
    messages: list[bytes | int], size: int, bits: int
) -> None:
    bus = bus_of(Recorder(0x40))
    bus.transaction(0x40, messages)
    assert (bus.transactions, bus.bytes, bus.bits) == (1, size, bits)


def test_refused_transaction_counts_what_was_on_the_wire() -> None:
    bus = bus_of(Recorder(0x40, refuses=b"\x02"))
    assert errno_of(bus, 0x40, b"\x01\x02\x03") == EREMOTEIO
    assert errno_of(bus, 0x41, b"\x01\x02\x03") == EREMOTEIO
    # START, three bytes, STOP; then START, one byte, STOP
    assert (bus.transactions, bus.errors, bus.bytes, bus.bits) == (2, 2, 4, 29 + 11)


@pytest.mark.parametrize(
    ("adapter", "address_refused", "byte_refused", "stuck"),
    [
        ("bcm2835", 121, 121, 110),
        ("designware", 121, 121, 110),
        ("i2c-gpio", 6, 5, 110),
        ("i2c-tiny-usb", 6, 6, 5),
    ],
)
def test_each_adapter_reports_its_own_errno(
    adapter: str, address_refused: int, byte_refused: int, stuck: int
) -> None:
    bus = bus_of(Recorder(0x40, refuses=b"\x02"), adapter=adapter)
    assert errno_of(bus, 0x41, b"\x01") == address_refused
    assert errno_of(bus, 0x40, b"\x02") == byte_refused
    bus.faults = FaultScript([StuckSda()])
    assert errno_of(bus, 0x40, b"\x01") == stuck


@pytest.mark.parametrize("adapter", ["bcm2835", "i2c-gpio", "i2c-tiny-usb"])
def test_empty_write_probes_an_address(adapter: str) -> None:
    chip = Recorder(0x40)
    bus = bus_of(chip, adapter=adapter)
    bus.write(0x40, b"")
    assert chip.seen == ["W", "P"]
    assert errno_of(bus, 0x41, b"") in {EREMOTEIO, errno.ENXIO}


@pytest.mark.parametrize(
    ("adapter", "messages"),
    [
        ("designware", [b""]),
        ("designware", [0]),
        ("i2c-tiny-usb", [0]),
        pytest.param("bcm2835", [1, b"\x00"], id="a read that is not last"),
    ],
)
def test_what_an_adapter_cannot_do_is_a_bus_fault_before_any_start(
    adapter: str, messages: list[bytes | int]
) -> None:
    chip = Recorder(0x40)
    bus = bus_of(chip, adapter=adapter)
    assert errno_of(bus, 0x40, *messages) == errno.EOPNOTSUPP
    with pytest.raises(BusFault, match=r"ENOTSUP|EOPNOTSUPP"):
        bus.transaction(0x40, messages)
    assert chip.seen == []


def test_linux_limits_of_messages_and_bytes_hold() -> None:
    bus = bus_of(Recorder(0x40))
    bus.transaction(0x40, [b"\x00"] * 42)
    assert errno_of(bus, 0x40, *[b"\x00"] * 43) == errno.EINVAL
    assert errno_of(bus, 0x40) == errno.EINVAL
    assert errno_of(bus, 0x40, bytes(8193)) == errno.EINVAL


def test_power_cycle_reaches_every_target_and_a_closed_bus_none() -> None:
    chips = [Recorder(0x40), Recorder(0x41)]
    bus = bus_of(*chips)
    bus.power_cycle()
    bus.close()
    with pytest.raises(PortClosed):
        bus.write(0x40, b"\x00")
    assert [chip.seen for chip in chips] == [["power"], ["power"]]


def test_log_has_instant_direction_bytes_and_error_and_is_bounded(clock: ManualClock) -> None:
    chip = Recorder(0x40, answers=b"\x12\x34")
    bus = I2cBusDouble("i2c-1", clock, [chip], log_length=2)
    for number in range(10):
        bus.write(0x40, bytes([number]))
    clock.advance(7)
    bus.write_read(0x40, b"\x3a", 2)
    errno_of(bus, 0x41, b"\x00\x01")
    done, failed = bus.log
    assert (done.at, done.written, done.to_read, done.answer) == (7, b"\x3a", 2, b"\x12\x34")
    assert [str(done), str(failed)] == ["0x40 W 3a, R 12 34", "0x41 W 00 01 -> errno 121"]
    assert bus.transactions == 12


def test_unknown_adapter_is_refused_with_those_known() -> None:
    with pytest.raises(ValueError, match=r"'bcm2711', expected one of \['bcm2835', 'designware'"):
        bus_of(adapter="bcm2711")


BUS_HZ = 100_000
NACK = wire_ns(1 + 9 + 1, BUS_HZ)
"""START, the address without an acknowledge, STOP."""


class Witness(Target):
    """Notes when everything came that the bus offers it."""

    def __init__(self, clock: ManualClock) -> None:
        self.seen: list[tuple[str, int]] = []
        self._clock = clock

    def start(self, address: int, *, read: bool) -> bool:  # noqa: ARG002 -- any will do
        self._note("start")
        return address == 0x40

    def write(self, byte: int) -> bool:
        self._note("write")
        return byte != 0xEE

    def read(self) -> int:
        self._note("read")
        return 0

    def stop(self) -> None:
        self._note("stop")

    def power_cycle(self) -> None:
        self.seen.clear()

    def _note(self, what: str) -> None:
        self.seen.append((what, self._clock()))


class Rig:
    def __init__(self, bus_hz: int = BUS_HZ, overhead_ns: int = 0) -> None:
        self.clock = ManualClock(at=1000)
        self.target = Witness(self.clock)
        self.bus = I2cBusDouble(
            "i2c-1",
            self.clock,
            [self.target],
            adapter="designware",
            bus_hz=bus_hz,
            overhead_ns=overhead_ns,
            reach=self.clock.reach,
        )


MESSAGES = st.lists(
    st.one_of(st.binary(min_size=1, max_size=40), st.integers(1, 40)), min_size=1, max_size=4
)


@given(MESSAGES, st.integers(10_000, 1_000_000), st.integers(0, 100_000))
def test_it_takes_its_bits_and_the_overhead(
    messages: list[Message], bus_hz: int, overhead_ns: int
) -> None:
    rig = Rig(bus_hz, overhead_ns)
    messages = [
        each.replace(b"\xee", b"") or 1 if isinstance(each, bytes) else each for each in messages
    ]
    rig.bus.transaction(0x40, messages)
    assert rig.clock() == 1000 + transaction_ns(messages, bus_hz, overhead_ns)
    assert rig.target.seen[0] == ("start", 1000 + overhead_ns)
    assert rig.target.seen[-1] == ("stop", rig.clock())


def test_what_is_written_arrives_at_the_end_of_its_message_and_what_is_read_at_its_beginning() -> (
    None
):
    rig = Rig()
    rig.bus.write(0x40, b"\x01\x02")
    end = 1000 + transaction_ns((b"\x01\x02",), BUS_HZ)
    assert rig.target.seen == [("start", 1000), ("write", end), ("write", end), ("stop", end)]
    rig = Rig()
    rig.bus.read(0x40, 1)
    assert rig.target.seen[:2] == [("start", 1000), ("read", 1000)]
    clock = ManualClock(at=1000)
    target = Witness(clock)
    I2cBusDouble("i2c-1", clock, [target]).write_read(0x40, b"\x00", 20)
    assert {at for _, at in target.seen} == {1000}, "without a clock to move"


@pytest.mark.parametrize(
    ("address", "message", "takes"),
    [
        pytest.param(0x41, bytes(30), NACK, id="an address that is not acknowledged"),
        pytest.param(0x40, b"", 0, id="what the adapter refuses"),
    ],
)
def test_a_transaction_that_fails_takes_no_more_than(
    address: int, message: bytes, takes: int
) -> None:
    rig = Rig()
    with pytest.raises(OSError, match=f"0x{address:x}"):
        rig.bus.transaction(address, (message,))
    assert rig.clock() == 1000 + takes


ADDRESS = 0x40
TIMES = 2000


class Numbered(RegisterTarget):
    """Every register reads as its own number."""

    def _read_register(self, register: int) -> int:
        return register

    def _write_register(self, register: int, byte: int) -> None:
        raise AssertionError(register, byte)


@pytest.fixture
def _threads_switch_often() -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.slow
@pytest.mark.usefixtures("_threads_switch_often")
def test_two_threads_never_read_each_others_bytes() -> None:
    clock = ManualClock()
    bus = I2cBusDouble("i2c-1", clock, [Numbered(clock, ADDRESS)], reach=clock.reach)
    wrong: list[bytes] = []

    def read_from(register: int) -> None:
        expected = bytes(range(register, register + 8))
        for _ in range(TIMES):
            found = bus.write_read(ADDRESS, bytes((register,)), 8)
            if found != expected:
                wrong.append(found)

    threads = [threading.Thread(target=read_from, args=(register,)) for register in (0x10, 0x80)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
    assert bus.transactions == 2 * TIMES
    assert bus.bytes == 2 * TIMES * 11
