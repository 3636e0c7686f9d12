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
