"""Buses that a driver opens when it is imported, while pytest collects: before any test has one.

    class Sensor:
        bus = SMBus(1)      # in a package as published

Such a bus is open, and each test that plugs doubles in at its number has them behind it. Used
before that it fails, as a bus does whose adapter is gone. What a test itself opens must be there.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self

_allowed: list[bool] = []


class OpenBus(int):
    """The descriptor of an open bus, behind whose path doubles may be plugged in."""

    path: str
    is_real: bool
    """True if it is the descriptor of a device node; as one of nothing, using it fails."""
    address = 0
    """The chip that SMBus calls go to."""
    has_codes = False
    """True if they have packet error codes."""

    @classmethod
    def of_nothing(cls, path: str) -> Self:
        """Return a descriptor that stands for a device node."""
        return cls.of(os.open(os.devnull, os.O_RDWR | os.O_CLOEXEC), path, is_real=False)

    @classmethod
    def of(cls, descriptor: int, path: str, *, is_real: bool) -> Self:
        """Return this descriptor, which knows its path."""
        made = cls(descriptor)
        made.path, made.is_real = path, is_real
        return made


def is_allowed() -> bool:
    """Return whether a bus may be opened that nothing is plugged in at."""
    return bool(_allowed)


@contextmanager
def openings() -> Iterator[None]:
    """Let buses be opened early within the block, those of the real smbus2 too."""
    from smbus2 import SMBus  # noqa: PLC0415 -- the one that drivers under test import

    really_open = SMBus.open

    def open_early(port: Any, bus: int | str) -> None:  # noqa: ANN401
        path = f"/dev/i2c-{bus}" if isinstance(bus, int) else bus
        try:
            really_open(port, bus)
            port.fd = OpenBus.of(port.fd, path, is_real=True)
        except FileNotFoundError:
            port.fd = OpenBus.of_nothing(path)

    SMBus.open = open_early  # type: ignore[method-assign, assignment]
    _allowed.append(True)
    try:
        yield
    finally:
        _allowed.pop()
        SMBus.open = really_open  # type: ignore[method-assign]
