"""Faults on the bus: each strikes where and as often as scripted, and is counted."""

import errno

import pytest

from firmware_runtime.hal.wire_errors import (
    ArbitrationLost,
    BusFault,
    BusTimeout,
    HalError,
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
from tests.support.wire import WiredChip

MODE1 = "W 00, R 11"
AWAKE = "W 00 21"


class Faulty(WiredChip[Pca9685Double]):
    """Two chips on a bus with faults; a line `8 reads ..x` reads as often, `x` is a failure."""

    def __init__(self, *faults: Fault, adapter: str = "bcm2835") -> None:
        clock = ManualClock()
        chips = [Pca9685Double(clock, 0x40), Pca9685Double(clock, 0x41)]
        super().__init__(clock, chips[0], 0x40, chips)
        self.bus.be_behind(adapter)
        self.script = self.bus.faults = FaultScript(faults)

    def transfer(self, line: str) -> None:
        address, reads, seen = line.partition(" reads ")
        if not reads:
            super().transfer(line)
            return
        letters = ""
        for _ in seen:
            try:
                self.bus.write_read(int(address, 16), b"\x00", 1)
            except HalError:
                letters += "x"
            else:
                letters += "."
        assert letters == seen

    def counts(self, *faults: Fault) -> list[int]:
        return [self.script.count(fault) for fault in faults]


@pytest.mark.parametrize(
    ("fault", "lines"),
    [
        pytest.param(
            NackAddress(first=1, last=4, times=None),
            "0x40 reads .xxxx..",
            id="without a limit it strikes until its last transaction",
        ),
        pytest.param(
            NackAddress(address=0x41, times=None),
            "0x40 reads ...; 0x41 reads xxx",
            id="it strikes only its address",
        ),
        pytest.param(
            NackAddress(since=20, until=30, times=None),
            "0x40 reads .; 10 ns; 0x40 reads .; 10 ns; 0x40 reads x; 10 ns; 0x40 reads x; 1 ns; "
            "0x40 reads .",
            id="it strikes between its instants",
        ),
        pytest.param(
            NackByte(index=2, first=1),
            f"{AWAKE}; W 02 a0 a2 a4 -> refused; W 02, R a0 e4 e8",
            id="a refused byte and all after it are lost",
        ),
        pytest.param(
            FlippedBit(index=0, bit=7), f"W 00, R 91; {MODE1}", id="a flipped bit arrives once"
        ),
        pytest.param(
            ForcedRegister(address=0x40, register=0x03, value=0x99),
            f"{AWAKE}; W 03, R 99; W 02, R e2 99 e8; W 04, R e8 e0",
            id="a forced register is wrong alone and within a burst",
        ),
        pytest.param(
            StuckSda(first=1),
            f"{AWAKE}; 0x40 reads xx; power cycle; {MODE1}",
            id="a stuck bus is free after a power cycle which resets its chips",
        ),
    ],
)
def test_a_fault_strikes(fault: Fault, lines: str) -> None:
    Faulty(fault).play(lines)


def test_a_fault_strikes_from_its_first_transaction_as_often_as_scripted() -> None:
    fault = NackAddress(first=2, times=3)
    faulty = Faulty(fault)
    faulty.play("0x40 reads ..xxx...")
    assert faulty.counts(fault) == [3] == [faulty.script.count()]
    assert [strike.number for strike in faulty.script.record] == [2, 3, 4]


def test_equal_faults_are_counted_apart_and_one_added_later_strikes_from_then_on() -> None:
    first, second = NackAddress(), NackAddress()
    faulty = Faulty(first, second)
    faulty.play("0x40 reads x.")
    assert faulty.counts(first, second) == [1, 1]
    faulty = Faulty()
    faulty.play("0x40 reads ..")
    faulty.script.add(NackAddress())
    faulty.play("0x40 reads x.")


def test_a_refused_byte_is_counted_across_messages_and_a_first_one_is_no_empty_message() -> None:
    bus = Faulty(NackByte(index=2), adapter="i2c-gpio").bus
    with pytest.raises(BusFault, match="EIO"):
        bus.transaction(0x40, [b"\x02", b"\x03\x04", 1])
    # START, address, 02; repeated START, address, 03, 04 refused; STOP
    assert (bus.bytes, bus.bits) == (5, 5 * 9 + 3)
    Faulty(NackByte(index=0), adapter="designware").play("W 00 -> refused")


def test_a_fault_waits_for_a_transaction_that_fits_and_an_adapter_error_needs_none() -> None:
    refused, flipped = NackByte(index=1), FlippedBit(index=1, bit=0)
    faulty = Faulty(refused, flipped)
    faulty.play(MODE1)
    assert faulty.counts(refused, flipped) == [0, 0]
    faulty.play(f"{AWAKE} -> refused")
    assert faulty.counts(refused, flipped) == [1, 0]
    faulty = Faulty(AdapterError(errno=errno.EAGAIN))
    with pytest.raises(ArbitrationLost):
        faulty.bus.write(0x40, b"\x00\x21")
    assert faulty.bus.bits == 0
    faulty.play(MODE1)


def test_a_stuck_bus_times_out_until_it_got_nine_pulses_and_no_other_fault_is_spent() -> None:
    faulty = Faulty(StuckSda(first=1), NackAddress(first=2))
    faulty.play("0x40 reads .xxx")
    with pytest.raises(BusTimeout):
        faulty.bus.write(0x40, b"\x00")
    for pulses, stuck in ((4, True), (5, False)):
        faulty.bus.recover(pulses=pulses)
        assert faulty.bus.stuck == stuck
    faulty.play("0x40 reads x.")


def test_a_brown_out_or_an_absence_is_of_one_chip() -> None:
    faulty = Faulty()
    faulty.script.add(BrownOut(target=faulty.chip, first=2))
    faulty.play("W 00 20; 0x41 W 00 20; W 00, R 11; 0x41 W 00, R 20")
    faulty = Faulty()
    faulty.script.add(AbsentTarget(target=faulty.chip, last=1))
    faulty.play("W 00 -> refused; 0x70 W 02 aa; 0x41 W 02, R aa; W 02, R e2")  # all-call: SUBADR1
