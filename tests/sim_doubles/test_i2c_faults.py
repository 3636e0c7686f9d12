"""Faults on the bus: each strikes where and as often as scripted, and is counted."""

import errno

import pytest

from firmware_runtime.hal.wire_errors import (
    ArbitrationLost,
    BusFault,
    BusTimeout,
    HalError,
    NoAcknowledge,
)
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.faults import (
    AbsentTarget,
    AdapterError,
    BrownOut,
    Fault,
    FaultScript,
    FlippedBit,
    ForcedRegister,
    NackAddress,
    NackByte,
    StuckSda,
)
from sim_doubles.i2c_bus import I2cBusDouble

MODE1_AI = b"\x00\x21"


def faulty_bus(*faults: Fault, adapter: str = "bcm2835") -> I2cBusDouble:
    clock = ManualClock()
    chips = [Pca9685Double(clock, 0x40), Pca9685Double(clock, 0x41)]
    return I2cBusDouble("i2c-1", clock, chips, adapter=adapter, faults=FaultScript(faults))


def outcomes(bus: I2cBusDouble, count: int, address: int = 0x40) -> str:
    """One letter a transaction: `.` went well, `x` did not."""
    letters = ""
    for _ in range(count):
        try:
            bus.write_read(address, b"\x00", 1)
        except HalError:
            letters += "x"
        else:
            letters += "."
    return letters


def test_fault_strikes_from_its_first_transaction_as_often_as_scripted() -> None:
    fault = NackAddress(first=2, times=3)
    bus = faulty_bus(fault)
    assert outcomes(bus, 8) == "..xxx..."
    assert bus.faults is not None
    assert bus.faults.count(fault) == bus.faults.count() == 3
    assert [strike.number for strike in bus.faults.record] == [2, 3, 4]


def test_fault_without_a_limit_strikes_until_its_last_transaction() -> None:
    assert outcomes(faulty_bus(NackAddress(first=1, last=4, times=None)), 7) == ".xxxx.."


def test_fault_strikes_only_its_address() -> None:
    bus = faulty_bus(NackAddress(address=0x41, times=None))
    assert outcomes(bus, 3, address=0x40) == "..."
    assert outcomes(bus, 3, address=0x41) == "xxx"


def test_fault_strikes_between_its_instants(clock: ManualClock) -> None:
    script = FaultScript([NackAddress(since=20, until=30, times=None)])
    bus = I2cBusDouble("i2c-1", clock, [Pca9685Double(clock)], faults=script)
    seen = ""
    for _ in range(5):
        seen += outcomes(bus, 1)
        clock.advance(10)
    assert seen == "..xx."


def test_two_equal_faults_are_counted_apart() -> None:
    first, second = NackAddress(), NackAddress()
    bus = faulty_bus(first, second)
    assert outcomes(bus, 2) == "x."
    assert bus.faults is not None
    assert (bus.faults.count(first), bus.faults.count(second)) == (1, 1)


def test_fault_added_later_strikes_from_then_on() -> None:
    bus = faulty_bus()
    assert outcomes(bus, 2) == ".."
    assert bus.faults is not None
    bus.faults.add(NackAddress())
    assert outcomes(bus, 2) == "x."


def test_refused_byte_and_all_after_it_are_lost() -> None:
    bus = faulty_bus(NackByte(index=2, first=1))
    bus.write(0x40, MODE1_AI)
    with pytest.raises(NoAcknowledge):
        bus.write(0x40, b"\x02\xa0\xa2\xa4")
    assert bus.write_read(0x40, b"\x02", 3) == b"\xa0\xe4\xe8"


def test_refused_byte_is_counted_across_messages_and_ends_the_transaction() -> None:
    bus = faulty_bus(NackByte(index=2), adapter="i2c-gpio")
    with pytest.raises(BusFault, match="EIO"):
        bus.transaction(0x40, [b"\x02", b"\x03\x04", 1])
    # START, address, 02; repeated START, address, 03, 04 refused; STOP
    assert (bus.bytes, bus.bits) == (5, 5 * 9 + 3)


def test_refused_first_byte_is_no_empty_message_for_the_adapter() -> None:
    bus = faulty_bus(NackByte(index=0), adapter="designware")
    with pytest.raises(NoAcknowledge):
        bus.write(0x40, b"\x00")


def test_fault_that_does_not_fit_a_transaction_waits_for_one_that_does() -> None:
    refused, flipped = NackByte(index=1), FlippedBit(index=1, bit=0)
    bus = faulty_bus(refused, flipped)
    bus.write_read(0x40, b"\x00", 1)
    assert bus.faults is not None
    assert bus.faults.count() == 0
    with pytest.raises(NoAcknowledge):
        bus.write(0x40, MODE1_AI)
    assert (bus.faults.count(refused), bus.faults.count(flipped)) == (1, 0)


def test_adapter_error_puts_nothing_on_the_wire() -> None:
    bus = faulty_bus(AdapterError(errno=errno.EAGAIN))
    with pytest.raises(ArbitrationLost):
        bus.write(0x40, MODE1_AI)
    assert bus.bits == 0
    assert bus.write_read(0x40, b"\x00", 1) == b"\x11"


def test_flipped_bit_arrives_inverted_once() -> None:
    bus = faulty_bus(FlippedBit(index=0, bit=7))
    assert bus.write_read(0x40, b"\x00", 1) == b"\x91"
    assert bus.write_read(0x40, b"\x00", 1) == b"\x11"


def test_forced_register_is_wrong_alone_and_within_a_burst() -> None:
    bus = faulty_bus(ForcedRegister(address=0x40, register=0x03, value=0x99))
    bus.write(0x40, MODE1_AI)
    assert bus.write_read(0x40, b"\x03", 1) == b"\x99"
    assert bus.write_read(0x40, b"\x02", 3) == b"\xe2\x99\xe8"
    assert bus.write_read(0x40, b"\x04", 2) == b"\xe8\xe0"
    assert bus.faults is not None
    assert bus.faults.count() == 2


def test_stuck_bus_times_out_until_it_got_nine_pulses() -> None:
    bus = faulty_bus(StuckSda(first=1))
    assert outcomes(bus, 4) == ".xxx"
    with pytest.raises(BusTimeout):
        bus.write(0x40, b"\x00")
    bus.recover(pulses=4)
    assert bus.stuck
    bus.recover(pulses=5)
    assert not bus.stuck
    assert outcomes(bus, 2) == ".."


def test_stuck_bus_is_free_after_a_power_cycle_which_resets_its_chips() -> None:
    bus = faulty_bus(StuckSda(first=1))
    bus.write(0x40, MODE1_AI)
    assert outcomes(bus, 1) == "x"
    bus.power_cycle()
    assert bus.write_read(0x40, b"\x00", 1) == b"\x11"


def test_no_other_fault_is_spent_on_a_stuck_bus() -> None:
    refused = NackAddress(first=1)
    bus = faulty_bus(StuckSda(), refused)
    assert outcomes(bus, 2) == "xx"
    bus.recover()
    assert outcomes(bus, 2) == "x."


def test_brown_out_takes_one_chip_back_to_its_power_up_state(clock: ManualClock) -> None:
    weak, strong = Pca9685Double(clock, 0x40), Pca9685Double(clock, 0x41)
    script = FaultScript([BrownOut(target=weak, first=2)])
    bus = I2cBusDouble("i2c-1", clock, [weak, strong], faults=script)
    bus.write(0x40, b"\x00\x20")
    bus.write(0x41, b"\x00\x20")
    assert bus.write_read(0x40, b"\x00", 1) == b"\x11"
    assert bus.write_read(0x41, b"\x00", 1) == b"\x20"


def test_absent_target_sees_nothing_while_others_answer_the_shared_address(
    clock: ManualClock,
) -> None:
    present, absent = Pca9685Double(clock, 0x40), Pca9685Double(clock, 0x41)
    script = FaultScript([AbsentTarget(target=absent, last=1)])
    bus = I2cBusDouble("i2c-1", clock, [present, absent], faults=script)
    with pytest.raises(NoAcknowledge):
        bus.write(0x41, b"\x00")
    bus.write(0x70, b"\x02\xaa")  # all-call: SUBADR1
    assert bus.write_read(0x40, b"\x02", 1) == b"\xaa"
    assert bus.write_read(0x41, b"\x02", 1) == b"\xe2"
