"""Single chips without a board: those on I2C on one bus, each other one on a port of its own."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from firmware_runtime.board.faults import Device, SerialDevice
from firmware_runtime.board.settings import BusSettings
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.budget import WireClock
from sim_doubles.chip_doubles import ChipDouble, chip_double
from sim_doubles.i2c_target import Target
from sim_doubles.rigs.board_rig import BoardRig

BUS: Final = "i2c1"
BUS_HZ: Final = 400_000
LEAST, LARGEST = 0x08, 0x77
"""The addresses that the I2C specification leaves to chips."""


class Placed(NamedTuple):
    """A chip's double, and where it is."""

    chip: ChipDouble
    address: int | None

    @property
    def name(self) -> str:
        """Return its name in logs: `pca9685@0x40`, or the name alone on a port."""
        return self.chip.name if self.address is None else f"{self.chip.name}@0x{self.address:02x}"


def placed(words: Sequence[str]) -> list[Placed]:
    """The chips that `NAME` or `NAME@ADDRESS` mean. Raises ConfigError with every fault."""
    found: list[Placed] = []
    faults: list[str] = []
    for word in words:
        try:
            found.append(_placed(word))
        except ConfigError as error:
            faults += [f"--chip {word}: {fault}" for fault in error.faults]
    if faults:
        raise ConfigError("doubles", faults)
    return found


def _placed(word: str) -> Placed:
    name, at, text = word.partition("@")
    chip = chip_double(name)
    if not at:
        return Placed(chip, chip.address)
    if chip.address is None:
        raise ConfigError(name, ["on a serial line, which has no address; expected the name alone"])
    try:
        address = int(text, 0)
    except ValueError:
        address = -1
    if not LEAST <= address <= LARGEST:
        raise ConfigError(name, [f"address {text!r}, expected 0x{LEAST:02x} to 0x{LARGEST:02x}"])
    return Placed(chip, address)


class ChipsRig(BoardRig):
    """The doubles of some chips, each in the world that it brings with it.

    Raises ConfigError for an address that a chip cannot have, and for two chips at one.
    """

    def __init__(self, chips: Sequence[Placed], clock: WireClock) -> None:
        on_bus = _on_bus(chips, clock)
        super().__init__({BUS: BusSettings("/dev/null", BUS_HZ)} if on_bus else {}, clock)
        for name, targets in on_bus.items():
            self.connect(BUS, *targets, name=name)
        for each in _on_ports(chips):
            self.plug_in(each.name, each.chip.on_port(clock), name=each.name)
        self.source: Path | None = None
        self.assignments: Sequence[str] = ()
        self.devices = [
            Device(each.name, each.chip.name, BUS, each.address)
            for each in chips
            if each.address is not None
        ]
        self.serial_devices: Sequence[SerialDevice] = ()
        """None by a name of its own: each port is called as its chip is."""


def _on_bus(chips: Sequence[Placed], clock: WireClock) -> dict[str, Sequence[Target]]:
    """The targets of each chip. Raises ConfigError with every address that cannot be."""
    made: dict[str, Sequence[Target]] = {}
    faults: list[str] = []
    taken: dict[int, str] = {}
    for name, chip, stated in [(each.name, each.chip, each.address) for each in chips]:
        if stated is None:
            continue
        try:
            made[name] = chip.on_bus(clock, stated)
        except ConfigError as error:
            faults += [f"--chip {name}: {fault}" for fault in error.faults]
            continue
        at = getattr(made[name][0], "address", stated)
        faults += [f"--chip {name}: {clash}" for clash in _clashes(stated, at, taken)]
        taken |= {at: f"the chip that comes with {name}", stated: name}
    if faults:
        raise ConfigError("doubles", faults)
    return made


def _clashes(stated: int, at: int, taken: Mapping[int, str]) -> list[str]:
    """Return the fault of a chip's stated place, or of the one that it comes with."""
    if stated in taken:
        return [f"0x{stated:02x} is that of {taken[stated]} already"]
    if at in taken:
        return [f"it comes with another chip, and 0x{at:02x} is that of {taken[at]} already"]
    return []


def _on_ports(chips: Sequence[Placed]) -> Sequence[Placed]:
    """The chips on ports. Raises ConfigError for two of a kind: ports are called as chips are."""
    on_ports = [each for each in chips if each.address is None]
    names = [each.name for each in on_ports]
    faults = [
        f"--chip {name}: given twice; expected one of a kind on a serial line"
        for name in dict.fromkeys(names)
        if names.count(name) > 1
    ]
    if faults:
        raise ConfigError("doubles", faults)
    return on_ports
