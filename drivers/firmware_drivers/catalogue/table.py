"""The chips that can be tried out, ours and those of other packages, found by entry point.

An entry point of the group `firmware_runtime.chips` is an `OnBus` or `OnPort` under its own name.
One that cannot be loaded is skipped with a sentence: it takes nothing from the others.
"""

import sys
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Final, NamedTuple

from firmware_drivers.catalogue.identity import WITHOUT_A_DRIVER
from firmware_drivers.catalogue.trial import Identity, OnBus, OnPort, Triable
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.system.packages import installed
from firmware_runtime.system.terminal import print_line

GROUP: Final = "firmware_runtime.chips"


@cache
def chips() -> Mapping[str, Triable]:
    """Every chip by its name on the command line, in alphabetical order."""
    found: dict[str, Triable] = {}
    for each in sorted(installed(GROUP), key=lambda entry_point: entry_point.name):
        try:
            found[each.name] = _checked(each.name, each.load())
        except Exception as error:  # noqa: BLE001 -- another package's module can raise anything
            print_line(f"firmware-runtime: chip {each.name} left out: {error}", sys.stderr)
    return MappingProxyType(found)


@cache
def identities() -> tuple[Identity, ...]:
    """Return what is recognisable on a bus, in order of addresses."""
    of_chips = [chip.identity for chip in chips().values() if isinstance(chip, OnBus)]
    known = (*WITHOUT_A_DRIVER, *(each for each in of_chips if each is not None))
    return tuple(sorted(known, key=lambda identity: min(identity.addresses)))


def _checked(name: str, chip: object) -> Triable:
    """The chip of an entry point. Raises TypeError or ValueError if it is none, or another's."""
    if not isinstance(chip, OnBus | OnPort):
        raise TypeError(f"its entry point is {type(chip).__name__}, expected OnBus or OnPort")
    if chip.name != name:
        raise ValueError(f"its entry point is of {chip.name!r}, expected that of {name!r}")
    return chip


class Recognition(NamedTuple):
    """Chips that an answer at an address is or could be, and a sentence."""

    chips: tuple[str, ...]
    certain: bool
    what: str


def recognise(bus: I2cBus, address: int) -> Recognition:
    """Ask an address that answers what it is.

    Raises the error of the bus where nothing was read that says what it is, or what it is not.
    """
    asked = [identity for identity in identities() if address in identity.addresses]
    if not asked:
        return Recognition((), False, "answers; no chip with a driver here lives at this address")
    found: list[tuple[Identity, str]] = []
    refuted: list[str] = []
    unread: HalError | None = None
    for identity in asked:
        try:
            found.append((identity, identity.evidence(bus, address)))
        except HalError as error:
            if isinstance(error, OSError):  # of the bus, and not of what was read
                unread = error
                continue
            refuted.append(f"no {identity.chip}: {str(error).rpartition(f' on {bus.name}: ')[2]}")
    if unread is not None and not found and not refuted:
        raise unread
    certain = [each for each in found if each[0].certain]
    chips = tuple(identity.chip for identity, _ in certain or found if identity.usable)
    if certain:
        sentences = [f"{identity.chip}: {evidence}" for identity, evidence in certain]
    elif found:
        sentences = [
            f"could be {identity.chip} (no identity register): {evidence}"
            for identity, evidence in found
        ]
    else:
        sentences = ["answers", *refuted]
    return Recognition(chips, bool(certain), "; ".join(sentences))
