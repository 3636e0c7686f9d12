"""Identity of each chip: registers to read, and only at addresses where it lives.

Reading a register takes its number to be written first. That sets a pointer, and changes the state
of none of these chips. Nothing else is ever written, and nothing at all where another usual chip
takes the first byte for more than a pointer; but a multiplexer at 0x70 to 0x77 (TCA9548A) does, and
closes its channels.
"""

from collections.abc import Callable
from contextlib import suppress
from typing import Final, Protocol

from firmware_drivers.catalogue.trial import Identity
from firmware_drivers.chips import ads1115, ak8963, cmps12, hmc5883l, md25, mpu9250, pca9685, srf08
from firmware_drivers.chips.ak8963 import Ak8963
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.hmc5883l import Hmc5883l
from firmware_drivers.chips.md25 import Md25
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.srf08 import Srf08
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import NotReady, WrongDevice

# What each is asked ------------------------------------------------------------------------------


class _Identified(Protocol):
    def identify(self) -> None:
        """Raise WrongDevice if it is another chip."""


def _by_driver(
    build: Callable[[I2cBus, int], _Identified], first: int, length: int, named: str = ""
) -> Callable[[I2cBus, int], str]:
    """Evidence by a driver's own check, with the registers that it judges by."""
    last = first + length - 1
    seen = f"{named} reads" if named else f"registers 0x{first:02x} to 0x{last:02x} read"

    def evidence(bus: I2cBus, address: int) -> str:
        build(bus, address).identify()
        found = bus.write_read(address, bytes((first,)), length).hex(" ")
        return f"{seen} {found}"

    return evidence


def _inertial(bus: I2cBus, address: int) -> str:
    chip = Mpu9250(bus, address)
    chip.identify()
    found = bus.write_read(address, bytes((mpu9250.WHO_AM_I,)), 1)[0]
    variant = {**mpu9250.KNOWN, **mpu9250.COMPATIBLE}[found]
    return f"WHO_AM_I reads {found:02x}" + (f", {variant}" if found != 0x71 else "")


ALL_CALL: Final = 0x70
_POWER_UP: Final = bytes((0xE2, 0xE4, 0xE8, 0xE0))
"""SUBADR1 to SUBADR3 and ALLCALLADR of a PCA9685, which hardly any program changes."""


def _pwm_registers(bus: I2cBus, address: int) -> bytes:
    """MODE1 to ALLCALLADR, one by one: at power-up the chip does not count on by itself.

    Raises WrongDevice unless they can be a PCA9685's.
    """
    registers = range(pca9685.MODE1, pca9685.MODE1 + 6)
    found = b"".join(bus.write_read(address, bytes((each,)), 1) for each in registers)
    if found[1] & 0xE0 or found[2:] != _POWER_UP:
        raise WrongDevice(
            f"0x{address:02x} on {bus.name}: registers 0 to 5 read {found.hex(' ')}",
            expected=f"MODE2 below 20 and {_POWER_UP.hex(' ')}",
        )
    return found


def _pwm(bus: I2cBus, address: int) -> str:
    found = _pwm_registers(bus, address)
    asleep = found[0] & pca9685.SLEEP
    state = "asleep, outputs off" if asleep else "awake: its outputs may be on"
    return f"registers 0 to 5 read {found.hex(' ')}, {state}"


def _all_call(bus: I2cBus, address: int) -> str:
    found = _pwm_registers(bus, address)
    return f"registers 0 to 5 read {found.hex(' ')}; a bring-up frees this address for others"


_revision: Final = _by_driver(Srf08, srf08.REVISION, 1, "its revision")


def _sonar(bus: I2cBus, address: int) -> str:
    evidence = _revision(bus, address)
    if address == ALL_CALL:
        with suppress(WrongDevice):
            _pwm_registers(bus, address)
            raise NotReady(f"0x{address:02x} on {bus.name}: a PCA9685 answers here too")
    return evidence


def _by_address_alone(_bus: I2cBus, _address: int) -> str:
    return "it is sold as HMC5883L and lives here; no driver can read it"


def _unasked(bus: I2cBus, address: int) -> str:
    """Nothing is written where a PCF8591 may be: to it a register's number is its control byte."""
    bus.read(address, 2)
    return "by its address alone; not asked, since a PCF8591 here would switch its output off"


AK8963_IDENTITY: Final = Identity(
    "AK8963", (ak8963.ADDRESS,), _by_driver(Ak8963, ak8963.WIA, 1, "WIA"), certain=True
)
HMC5883L_IDENTITY: Final = Identity(
    "HMC5883L",
    (hmc5883l.ADDRESS,),
    _by_driver(
        lambda bus, _: Hmc5883l(bus), hmc5883l.IDENTITY_A, len(hmc5883l.IDENTITY), "its identity"
    ),
    certain=True,
)
PCA9685_IDENTITY: Final = Identity("PCA9685", (*range(0x40, 0x48), *cmps12.ADDRESSES), _pwm)
"""It can be strapped to any address from 0x40 on; where other chips that take a first byte for more
than a pointer are usual, it is not asked."""
ADS1115_IDENTITY: Final = Identity("ADS1115", ads1115.ADDRESSES, _unasked)
MD25_IDENTITY: Final = Identity(
    "MD25", md25.ADDRESSES, _by_driver(Md25, md25.REVISION, md25.SETTINGS.size)
)
CMPS12_IDENTITY: Final = Identity(
    "CMPS12", cmps12.ADDRESSES, _by_driver(Cmps12, cmps12.VERSION, cmps12.IDENTITY.size)
)
MPU9250_IDENTITY: Final = Identity("MPU-9250", Mpu9250.addresses, _inertial, certain=True)
SRF08_IDENTITY: Final = Identity("SRF08", range(0x70, 0x78), _sonar)

WITHOUT_A_DRIVER: Final = (
    Identity("QMC5883L", (0x0D,), _by_address_alone, usable=False),
    Identity("QMC5883P", (0x2C,), _by_address_alone, usable=False),
    Identity("the all-call address of every PCA9685", (ALL_CALL,), _all_call, usable=False),
)
"""Chips that may answer beside those that can be tried out."""
