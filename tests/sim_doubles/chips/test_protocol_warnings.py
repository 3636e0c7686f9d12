"""Warnings of a double: named, bounded, counted."""

from sim_doubles.chips.protocol_warnings import ProtocolWarnings


def test_warning_names_its_chip() -> None:
    warnings = ProtocolWarnings("PCA9685 0x40")
    warnings.note("PRE_SCALE written awake; the real chip ignores it")
    assert warnings == ["PCA9685 0x40: PRE_SCALE written awake; the real chip ignores it"]


def test_first_hundred_warnings_are_kept_and_all_are_counted() -> None:
    warnings = ProtocolWarnings("chip")
    for number in range(250):
        warnings.note(str(number))
    assert (len(warnings), warnings[-1], warnings.total) == (100, "chip: 99", 250)


def test_first_warning_of_each_kind_is_kept_however_many_came_before() -> None:
    warnings = ProtocolWarnings("chip")
    for number in range(250):
        warnings.note(f"accessed {number / 10} ms too early, register 0x{number:02x}")
    warnings.note("EXTCLK set; the real chip keeps it until a reset")
    warnings.note("mode 3 does not exist")
    warnings.note("mode 5 does not exist")
    assert warnings[100:] == [
        "chip: EXTCLK set; the real chip keeps it until a reset",
        "chip: mode 3 does not exist",
    ]
    assert warnings.total == 253


def test_packets_that_differ_in_bytes_are_of_one_kind() -> None:
    warnings = ProtocolWarnings("chip")
    for number in range(150):
        packet = bytes((0x80, number, 0x3F))
        warnings.note(f"packet {packet.hex(' ')} has a wrong checksum; it is ignored")
    assert len(warnings) == 100
