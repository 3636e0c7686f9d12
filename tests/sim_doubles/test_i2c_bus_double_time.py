"""A transaction on the bus double takes the time that the budget says it does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.hal.budget import transaction_ns, wire_ns
from firmware_runtime.hal.i2c import Message
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target

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


def test_what_is_written_arrives_when_its_message_has_ended() -> None:
    rig = Rig()
    rig.bus.write(0x40, b"\x01\x02")
    end = 1000 + transaction_ns((b"\x01\x02",), BUS_HZ)
    assert rig.target.seen == [("start", 1000), ("write", end), ("write", end), ("stop", end)]


def test_what_is_read_is_what_was_so_when_its_message_began() -> None:
    rig = Rig()
    rig.bus.read(0x40, 1)
    assert rig.target.seen[:2] == [("start", 1000), ("read", 1000)]


def test_an_address_that_is_not_acknowledged_takes_no_more_than_that() -> None:
    rig = Rig()
    with pytest.raises(OSError, match="0x41"):
        rig.bus.transaction(0x41, (bytes(30),))
    assert rig.clock() == 1000 + NACK


def test_a_transaction_the_adapter_refuses_takes_no_time() -> None:
    rig = Rig()
    with pytest.raises(OSError, match="0x40"):
        rig.bus.transaction(0x40, (b"",))
    assert rig.clock() == 1000


def test_without_a_clock_to_move_it_happens_at_one_instant() -> None:
    clock = ManualClock(at=1000)
    target = Witness(clock)
    I2cBusDouble("i2c-1", clock, [target]).write_read(0x40, b"\x00", 20)
    assert {at for _, at in target.seen} == {1000}
