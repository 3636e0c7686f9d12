"""Lets other people's buses open doubles, wherever and whenever they were imported.

`smbus2.SMBus` stays the class it is and opens as ours does, so what was imported by name and what
is derived from it opens doubles too. A real `smbus` is a compiled class that nothing can be put
into, and Blinka's `busio.I2C` wants a machine it knows: there ours takes the place of theirs.
"""

import sys

import pytest

from sim_doubles import busio, smbus
from sim_doubles.testing.substitution import substitute


def open_doubles(patch: pytest.MonkeyPatch) -> None:
    """Let every SMBus and busio.I2C open doubles until the patch is undone."""
    import smbus2  # noqa: PLC0415 -- the one of the driver under test, for which doubles stand

    patch.setattr(smbus2.SMBus, "open", smbus.SMBus.open)
    for module, name, ours in (("smbus", "SMBus", smbus.SMBus), ("busio", "I2C", busio.I2C)):
        theirs = getattr(sys.modules.get(module), name, ours)
        if theirs is not ours:
            patch.setattr(sys.modules[module], name, ours)
            substitute(patch, {theirs: ours})
