"""Buses that a driver opens when it is imported, while pytest collects: before any test has one.

    class Sensor:
        bus = SMBus(1)      # in a package as published

Such a bus is open, and each test that plugs doubles in at its number has them behind it. Used
before that it fails, as a bus does whose adapter is gone. What a test itself opens must be there.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_allowed: list[bool] = []


def is_allowed() -> bool:
    """Whether a bus may be opened that nothing is plugged in at."""
    return bool(_allowed)


def placeholder() -> int:
    """Return a descriptor to stand for the device node; using it as one fails."""
    return os.open(os.devnull, os.O_RDWR | os.O_CLOEXEC)


@contextmanager
def openings() -> Iterator[None]:
    """Let buses be opened early within the block, those of the real smbus2 too."""
    from smbus2 import SMBus  # noqa: PLC0415 -- the one that drivers under test import

    really_open = SMBus.open

    def open_early(port: Any, bus: int | str) -> None:  # noqa: ANN401
        port._path = f"/dev/i2c-{bus}" if isinstance(bus, int) else bus  # noqa: SLF001
        try:
            really_open(port, bus)
        except FileNotFoundError:
            port.fd = placeholder()

    SMBus.open = open_early  # type: ignore[method-assign, assignment]
    _allowed.append(True)
    try:
        yield
    finally:
        _allowed.pop()
        SMBus.open = really_open  # type: ignore[method-assign]
