"""What chips with 16-bit registers share, on a chip of our own making."""

import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.chips.register_target import ByteOrder, RegisterTarget
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

ADDRESS = 0x36
ONE_BYTE, READ_ONLY, LITTLE = 0x04, 0x06, 0x08


class Chip(RegisterTarget):
    """Words that count on, one of them of one byte; what is read changes with every reading."""

    def __init__(self) -> None:
        super().__init__(ManualClock(), ADDRESS)
        self.words = {0x00: 0x1234, 0x02: 0x5678, ONE_BYTE: 0x9A, LITTLE: 0x0102}
        self.reads = 0
        self.cut = 0

    def _after(self, register: int) -> int:
        return register + 2

    def _width(self, register: int) -> int:
        return 1 if register == ONE_BYTE else 2

    def _order(self, register: int) -> ByteOrder:
        return "little" if register == LITTLE else "big"

    def _writes_to(self, register: int) -> bool:
        return register != READ_ONLY

    def _cut_short(self, register: int) -> None:  # noqa: ARG002
        self.cut += 1

    def _read_register(self, register: int) -> int:
        self.reads += 1
        return self.words.get(register, 0)

    def _write_register(self, register: int, byte: int) -> None:
        self.words[register] = byte


def wired() -> tuple[Chip, I2cBusDouble]:
    chip = Chip()
    return chip, I2cBusDouble("i2c-1", ManualClock(), [chip])


def test_words_come_high_byte_first_and_the_pointer_goes_on_after_each() -> None:
    chip, bus = wired()
    assert bus.write_read(ADDRESS, b"\x00", 5) == b"\x12\x34\x56\x78\x9a"
    assert chip.reads == 3


def test_a_register_may_have_its_low_byte_first() -> None:
    chip, bus = wired()
    assert bus.write_read(ADDRESS, bytes((LITTLE,)), 2) == b"\x02\x01"
    bus.write(ADDRESS, bytes((LITTLE, 0xCD, 0xAB)))
    assert chip.words[LITTLE] == 0xABCD


def test_a_word_is_taken_with_its_last_byte() -> None:
    chip, bus = wired()
    bus.write(ADDRESS, b"\x00\xab\xcd\xef")
    assert (chip.words[0x00], chip.words[0x02], chip.cut) == (0xABCD, 0x5678, 1)


def test_what_is_left_of_a_word_is_dropped_with_the_next_start() -> None:
    _, bus = wired()
    assert bus.write_read(ADDRESS, b"\x00", 1) == b"\x12"
    assert bus.read(ADDRESS, 2) == b"\x56\x78"


def test_a_byte_that_is_refused_ends_the_transaction() -> None:
    chip, bus = wired()
    with pytest.raises(NoAcknowledge):
        bus.write(ADDRESS, bytes((READ_ONLY, 1, 2)))
    assert READ_ONLY not in chip.words


def test_a_loss_of_power_leaves_nothing_half_read() -> None:
    _, bus = wired()
    bus.write_read(ADDRESS, b"\x02", 1)
    bus.power_cycle()
    assert bus.read(ADDRESS, 2) == b"\x12\x34"
