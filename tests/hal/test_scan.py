"""Scanning a bus: which addresses answer, and what may never be put on the wire to find out."""

import errno
from collections.abc import Mapping, Sequence

import pytest

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.scan import ADDRESSES, State, scan
from firmware_runtime.hal.wire_errors import EREMOTEIO, AddressInUse, BusTimeout, NoAcknowledge
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import AdapterError, FaultScript, StuckSda
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import ADAPTERS


def now() -> int:
    return 0


def bus_of_two(adapter: str = "bcm2835") -> I2cBusDouble:
    chips = [Pca9685Double(now, 0x43), Md25Double(now, 0x5A)]
    return I2cBusDouble("i2c1", now, chips, adapter=adapter)


@pytest.mark.parametrize("adapter", sorted(ADAPTERS))
def test_what_answers_is_found_through_every_adapter(adapter: str) -> None:
    found = [(each.address, each.state) for each in scan(bus_of_two(adapter))]
    assert found == [(0x43, State.ANSWERS), (0x5A, State.ANSWERS), (0x70, State.ANSWERS)]


@pytest.mark.parametrize("adapter", sorted(ADAPTERS))
def test_no_byte_is_written_and_nothing_at_all_where_eeproms_live(adapter: str) -> None:
    bus = bus_of_two(adapter)
    list(scan(bus))
    assert {each.messages for each in bus.log} <= {(b"",), (1,)}
    nothing_written = {each.address for each in bus.log if each.messages == (b"",)}
    assert set(ADDRESSES) - nothing_written == {*range(0x30, 0x38), *range(0x50, 0x60)}


def test_addresses_that_the_bus_reserves_are_left_alone_and_no_others() -> None:
    bus = bus_of_two()
    list(scan(bus))
    reserved = {*range(0x08), *range(0x78, 0x80)}
    assert {each.address for each in bus.log} == {*range(0x80)} - reserved


def test_a_bus_whose_line_is_held_is_given_up_at_the_first_address() -> None:
    bus = bus_of_two()
    bus.faults = FaultScript([StuckSda(address=0x43)])
    with pytest.raises(BusTimeout):
        list(scan(bus))
    assert bus.log[-1].address == 0x43


def test_a_bus_that_times_out_once_is_asked_to_the_end() -> None:
    bus = bus_of_two()
    late = AdapterError(address=0x43, errno=errno.ETIMEDOUT)
    bus.faults = FaultScript([late])
    found = [(each.address, each.state) for each in scan(bus)]
    assert found == [(0x43, State.ANSWERS), (0x5A, State.ANSWERS), (0x70, State.ANSWERS)]
    assert [each.address for each in bus.log].count(0x43) == 3  # twice, and once again


@pytest.mark.parametrize(
    ("errors", "state"),
    [
        ({1: EREMOTEIO}, State.FAULTY),
        ({0: errno.EIO, 1: errno.EIO}, State.FAULTY),
        ({0: errno.EIO}, State.ANSWERS),  # as an adapter that cannot write nothing
    ],
)
def test_an_address_answers_only_if_it_acknowledges_twice(
    errors: Mapping[int, int], state: State
) -> None:
    bus = bus_of_two()
    faults = [
        AdapterError(address=0x43, first=number, last=number, errno=error)
        for number, error in errors.items()
    ]
    bus.faults = FaultScript(faults)
    assert [each.state for each in scan(bus, [0x43])] == [state]


def test_an_absent_chip_is_absent_after_a_fault_of_the_adapter() -> None:
    bus = bus_of_two()
    bus.faults = FaultScript([AdapterError(address=0x21, errno=errno.EIO)])
    assert list(scan(bus, [0x21])) == []


class HeldBus(I2cBus):
    """A kernel driver holds one address; nothing else is there."""

    name = "i2c1"

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:  # noqa: ARG002
        raise AddressInUse("held") if address == 0x68 else NoAcknowledge("nothing")


def test_an_address_that_the_kernel_holds_is_reported_and_not_counted_as_absent() -> None:
    assert [(each.address, each.state) for each in scan(HeldBus())] == [(0x68, State.HELD)]
