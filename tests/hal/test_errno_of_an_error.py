"""The errno of an error is found again by its class and its sentence, as a recording has them."""

import errno
import os

import pytest

from firmware_runtime.hal.wire_errors import errno_of, from_os_error


@pytest.mark.parametrize("number", sorted(errno.errorcode))
def test_what_an_adapter_reported_is_found_again(number: int) -> None:
    error = from_os_error(OSError(number, os.strerror(number)), "i2c1 0x68")
    assert errno_of(type(error).__name__, str(error)) == number


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        ("NoAcknowledge", errno.EREMOTEIO),
        ("BusTimeout", errno.ETIMEDOUT),
        ("BusFault", errno.EIO),
        ("LettersLost", errno.EIO),
    ],
)
def test_without_an_errno_the_class_says_it(kind: str, number: int) -> None:
    assert errno_of(kind, "sonar: unplugged (pulled out)") == number
