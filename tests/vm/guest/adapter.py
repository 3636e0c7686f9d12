"""Doubles behind a real `/dev/i2c-N`: what programs see that know nothing of doubles."""

from typing import Final

from tests.vm.guest.machine import PYTHON, device_of, expect, run
from tests.vm.guest.report import Check

HERE: Final = "tests.vm.guest.probes"


def _probe(name: str) -> str:
    """Run one of the probes, in the program's own Python."""
    return run(PYTHON, "-m", HERE, name, device_of("tachobot")).strip()


def smbus2_reads_who_i_am_through_the_kernel() -> str:
    """An SMBus call, which the kernel makes two messages of."""
    return _probe("identity")


def an_adapter_says_what_it_can_do() -> str:
    """Plain transfers, and every SMBus call but one."""
    return _probe("functionality")


def a_register_keeps_what_i2c_rdwr_wrote() -> str:
    """Sixteen registers of a PCA9685 at once, read back after a repeated START."""
    return _probe("round_trip")


def an_absent_address_is_not_acknowledged() -> str:
    """ENXIO from the kernel, NoAcknowledge from our bus."""
    return _probe("absent")


def a_read_that_is_not_last_and_two_addresses_are_carried_out() -> str:
    """As the driver of this adapter allows; a Pi's own would refuse it."""
    return _probe("read_first")


def our_linux_bus_reads_a_burst() -> str:
    """The bus the robot uses, 23 bytes at a time."""
    return _probe("burst")


def i2cdetect_finds_the_chips() -> str:
    """A program in C, and zero-length writes."""
    shown = run("i2cdetect", "-y", str(device_of("tachobot")).removeprefix("/dev/i2c-"))
    rows = [line.split(":")[1].split() for line in shown.splitlines()[1:]]
    found = sorted(word for row in rows for word in row if word != "--")
    expect(found == ["40", "68", "70"], f"it found {found}")
    return f"at {', '.join(found)}"


CHECKS: Final[tuple[Check, ...]] = (
    smbus2_reads_who_i_am_through_the_kernel,
    an_adapter_says_what_it_can_do,
    a_register_keeps_what_i2c_rdwr_wrote,
    an_absent_address_is_not_acknowledged,
    a_read_that_is_not_last_and_two_addresses_are_carried_out,
    our_linux_bus_reads_a_burst,
    i2cdetect_finds_the_chips,
)
