"""Catalogue entry of the CHIP_PRINTED, for `firmware-runtime try` and `probe`."""

from typing import Final

from firmware_drivers.catalogue.trial import Identity, OnBus, Options, Quantity, Reading, Sensor
from firmware_runtime.hal.i2c import I2cBus

from chipname.driver import ADDRESSES, IDENTITY, ChipName


def _build(bus: I2cBus, address: int, _options: Options) -> Sensor:
    chip = ChipName(bus, address)

    def read() -> Reading:
        return QUANTITY_ROWS

    return Sensor(place=chip.place, bring_up=chip.bring_up, read=read)


def _evidence(bus: I2cBus, address: int) -> str:
    return ChipName(bus, address).evidence()


CHIP: Final = OnBus(
    name="chipname",
    title="CHIP_PRINTED, CHIP_TITLE",
    address=ADDRESSES[0],
    addresses=ADDRESSES,
    build=_build,
    identity=Identity(
        "CHIP_PRINTED",
        ADDRESSES,
        _evidence,
        certain=all(expected.word is not None for expected in IDENTITY),
    ),
)
