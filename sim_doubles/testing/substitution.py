"""Putting one object in another's place in every module that has it under a name.

A driver that says `from time import sleep` has its own name for the function; replacing
`time.sleep` alone would pass it by. The standard library, pytest and its helpers, and this project
keep what they have: they need the real thing to run the tests.
"""

import sys
from collections.abc import Mapping
from typing import Any, Final

import pytest

KEPT: Final = frozenset(
    {
        *sys.stdlib_module_names,
        *("_pytest", "pytest", "pluggy", "xdist", "execnet", "pytest_timeout", "pytest_cov"),
        *("hypothesis", "coverage", "pytest_asyncio", "anyio"),
        *("firmware_runtime", "sim_doubles", "firmware_drivers", "firmware_boards"),
    }
)
"""Packages that keep what they imported."""


def substitute(patch: pytest.MonkeyPatch, substitutes: Mapping[Any, object]) -> None:
    """Replace each key by its value wherever a module has it, until the patch is undone."""
    found = [
        (module, name, substitutes[value])
        for key, module in list(sys.modules.items())
        if key.partition(".")[0] not in KEPT
        for name, value in list(getattr(module, "__dict__", {}).items())
        if type(value) in {type(each) for each in substitutes} and value in substitutes
    ]
    for module, name, ours in found:
        patch.setattr(module, name, ours)


def open_doubles(patch: pytest.MonkeyPatch) -> None:
    """Let every SMBus and busio.I2C open doubles until the patch is undone.

    `smbus2.SMBus` stays the class it is and opens as ours does, so what was imported by name and
    what is derived from it opens doubles too. A real `smbus` is a compiled class that nothing can
    be put into, and Blinka's `busio.I2C` wants a machine it knows: ours takes the place of theirs.
    """
    import smbus2  # noqa: PLC0415 -- the one of the driver under test, for which doubles stand

    from sim_doubles import busio, smbus  # noqa: PLC0415 -- a clock needs neither

    patch.setattr(smbus2.SMBus, "open", smbus.SMBus.open)
    for module, name, ours in (("smbus", "SMBus", smbus.SMBus), ("busio", "I2C", busio.I2C)):
        theirs = getattr(sys.modules.get(module), name, ours)
        if theirs is not ours:
            patch.setattr(sys.modules[module], name, ours)
            substitute(patch, {theirs: ours})
