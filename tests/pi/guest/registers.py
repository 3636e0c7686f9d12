"""The real driver of the Pi's I2C controllers, on memories."""

from contextlib import closing
from pathlib import Path
from typing import Final

from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.wire_errors import BusFault, NoAcknowledge
from tests.pi.guest.emulated import BUS
from tests.vm.guest.machine import expect
from tests.vm.guest.report import Check

ABSENT: Final = 0x21


def three_controllers_have_the_pis_own_driver() -> str:
    """By name."""
    names = [
        path.read_text(encoding="ascii").strip()
        for path in sorted(Path("/sys/bus/i2c/devices").glob("i2c-*/name"))
    ]
    expect(len(names) == 3, f"adapters: {names}")
    expect(all(name.startswith("bcm2835 (i2c@") for name in names), f"adapters: {names}")
    return ", ".join(names)


def registers_keep_what_was_written_and_are_read_after_a_repeated_start() -> None:
    """64 at once, twice."""
    with closing(open_i2c("i2c1", BUS, timeout_ms=1000)) as bus:
        for content in (bytes(range(64)), bytes(64)):
            bus.write(0x68, b"\x06" + content)
            found = bus.write_read(0x68, b"\x06", 64)
            expect(found == content, f"read {found.hex()}")


def an_absent_chip_is_not_acknowledged() -> str:
    """EREMOTEIO, which becomes NoAcknowledge."""
    with closing(open_i2c("i2c1", BUS, timeout_ms=1000)) as bus:
        try:
            bus.write_read(ABSENT, b"\0", 1)
        except NoAcknowledge as error:
            return str(error)
    raise AssertionError("it answered")


def a_read_that_is_not_last_is_refused_in_a_sentence() -> str:
    """The driver cannot do it, and says so before anything is sent."""
    with closing(open_i2c("i2c1", BUS, timeout_ms=1000)) as bus:
        try:
            bus.transaction(0x40, (1, b"\0"))
        except BusFault as error:
            expect("read that is not last" in str(error), str(error))
            return str(error)
    raise AssertionError("it was carried out")


CHECKS: Final[tuple[Check, ...]] = (
    three_controllers_have_the_pis_own_driver,
    registers_keep_what_was_written_and_are_read_after_a_repeated_start,
    an_absent_chip_is_not_acknowledged,
    a_read_that_is_not_last_is_refused_in_a_sentence,
)
