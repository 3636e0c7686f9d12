"""Recognition of chips by their registers, of those only that live at an address."""

from typing import NamedTuple

from firmware_drivers.catalogue.table import identities
from firmware_drivers.catalogue.trial import Identity
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import HalError


class Recognition(NamedTuple):
    """Chips that an answer at an address is or could be, and a sentence."""

    chips: tuple[str, ...]
    certain: bool
    what: str


def recognise(bus: I2cBus, address: int) -> Recognition:
    """Ask an address that answers what it is. Errors of the bus are in the answer, not raised."""
    asked = [identity for identity in identities() if address in identity.addresses]
    if not asked:
        return Recognition((), False, "answers; no chip with a driver here lives at this address")
    found: list[tuple[Identity, str]] = []
    refuted: list[str] = []
    for identity in asked:
        try:
            found.append((identity, identity.evidence(bus, address)))
        except HalError as error:
            refuted.append(f"no {identity.chip}: {str(error).rpartition(f' on {bus.name}: ')[2]}")
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
