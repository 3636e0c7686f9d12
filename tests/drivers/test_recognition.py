"""Chips recognised by reading, those of other packages, and addresses that cannot be."""

import errno
from collections.abc import Callable, Iterator
from typing import NamedTuple

import pytest
from firmware_drivers.catalogue import table
from firmware_drivers.catalogue.sensors import HMC5883L, MAXBOTIX
from firmware_drivers.catalogue.table import recognise
from firmware_drivers.catalogue.trial import Identity, OnBus
from firmware_drivers.chips.ads1115 import Ads1115
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.md25 import Md25
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.srf08 import Srf08

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import BusFault, BusTimeout, HalError, NoAcknowledge
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.faults import AdapterError, Fault, FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth
from tests.support.bare_chip import RegisterBus

REST = InertialTruth((0.0, 0.0, 9.8), (0.0, 0.0, 0.0), (2e-5, 0.0, -4e-5), 25.0)


def now() -> int:
    return 0


def inertial(who_am_i: int) -> Target:
    return Mpu9250Double(now, lambda _: REST, 0x68, who_am_i=who_am_i, noise_seed=None)


CHIPS: list[tuple[int, Target, str, bool]] = [
    (0x0C, Ak8963Double(now, lambda _: REST.field, noise_seed=None), "AK8963", True),
    (0x1E, Hmc5883lDouble(now, lambda _: REST.field, noise_seed=None), "HMC5883L", True),
    (0x40, Pca9685Double(now, 0x40), "PCA9685", False),
    (0x60, Pca9685Double(now, 0x60), "PCA9685", False),
    (0x49, Ads1115Double(now, 0x49, inputs=lambda _: (0.0, 0.0, 0.0, 0.0)), "ADS1115", False),
    (0x5B, Md25Double(now, 0x5B), "MD25", False),
    (0x60, Cmps12Double(now, 0x60, bearing_deg=lambda _: 271.3, noise_seed=None), "CMPS12", False),
    (0x68, inertial(0x71), "MPU-9250", True),
    (0x68, inertial(0x70), "MPU-9250", True),
    (0x70, Srf08Double(now, 0x70, echoes=lambda _: [1.0]), "SRF08", False),
    (0x76, Srf08Double(now, 0x76, echoes=lambda _: [1.0]), "SRF08", False),
]


SEEN = {
    "AK8963": "WIA reads 48",
    "HMC5883L": "its identity reads 48 34 33",
    "PCA9685": "registers 0 to 5 read 11 04 e2 e4 e8 e0, asleep, outputs off",
    "ADS1115": "by its address alone; not asked",
    "MD25": "registers 0x0d to 0x0f read 02 05 00",
    "CMPS12": "registers 0x00 to 0x03 read 07 c0 0a 99",
    "MPU-9250": "WHO_AM_I reads 7",
    "SRF08": "its revision reads 0a",
}


@pytest.mark.parametrize(("address", "chip", "name", "certain"), CHIPS)
def test_a_chip_is_recognised_by_reading_and_only_numbers_of_registers_are_written(
    address: int, chip: Target, name: str, *, certain: bool
) -> None:
    bus = I2cBusDouble("i2c1", now, [chip])
    found = recognise(bus, address)
    assert found.chips == (name,)
    assert found.certain is certain
    assert ("no identity register" in found.what) is not certain
    assert f": {SEEN[name]}" in found.what
    assert chip.warnings == []  # type: ignore[attr-defined]
    assert bus.log
    for each in bus.log:
        *pointers, length = each.messages
        assert isinstance(length, int)
        assert [len(pointer) for pointer in pointers if isinstance(pointer, bytes)] in ([], [1])


def test_nothing_at_all_is_written_where_a_converter_would_switch_its_output_off() -> None:
    bus = I2cBusDouble(
        "i2c1", now, [Ads1115Double(now, 0x48, inputs=lambda _: (0.0, 0.0, 0.0, 0.0))]
    )
    assert recognise(bus, 0x48).chips == ("ADS1115",)
    assert [each.messages for each in bus.log] == [(2,)]


@pytest.mark.parametrize(
    ("chip", "address", "what"),
    [
        (Pca9685Double(now, 0x40), 0x70, "all-call"),
        (inertial(0x68), 0x68, "an MPU-6050"),
    ],
)
def test_what_answers_and_is_none_of_ours_is_named_and_not_taken_for_it(
    chip: Target, address: int, what: str
) -> None:
    found = recognise(I2cBusDouble("i2c1", now, [chip]), address)
    assert found.chips == ()
    assert what in found.what


def test_what_a_driver_woke_shows_and_what_is_none_of_ours_is_not_asked() -> None:
    bus = I2cBusDouble("i2c1", now, [Pca9685Double(now, 0x40)])
    assert "asleep" in recognise(bus, 0x40).what
    bus.write(0x40, b"\x00\x20")
    assert "awake" in recognise(bus, 0x40).what
    bus = I2cBusDouble("i2c1", now, [])
    assert recognise(bus, 0x3C).chips == ()
    assert not bus.log


@pytest.mark.parametrize(
    ("fault", "raised"),
    [
        (NackAddress(address=0x68, times=None), NoAcknowledge),
        (AdapterError(address=0x68, errno=errno.EIO), BusFault),
        (AdapterError(address=0x68, errno=errno.ETIMEDOUT), BusTimeout),
    ],
)
def test_a_chip_that_cannot_be_read_is_no_chip_but_an_error_of_the_bus(
    fault: Fault, raised: type[HalError]
) -> None:
    bus = I2cBusDouble("i2c1", now, [inertial(0x71)])
    bus.faults = FaultScript([fault])
    with pytest.raises(raised):
        recognise(bus, 0x68)


class EntryPoint(NamedTuple):
    name: str
    loaded: object

    def load(self) -> object:
        if isinstance(self.loaded, Exception):
            raise self.loaded
        return self.loaded


def evidence(_bus: object, _address: int) -> str:
    return "it says so"


MINE = OnBus(
    name="mine",
    title="a chip of my own",
    address=0x29,
    addresses=(0x29,),
    build=HMC5883L.build,
    identity=Identity("MINE", (0x29,), evidence, certain=True),
)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[EntryPoint]]:
    found = [EntryPoint("hmc5883l", HMC5883L), EntryPoint("maxbotix", MAXBOTIX)]
    monkeypatch.setattr(table, "installed", lambda _: found)
    forget()
    yield found
    forget()


def forget() -> None:
    table.chips.cache_clear()
    table.identities.cache_clear()


def test_a_chip_of_another_package_is_tried_and_recognised_like_ours(
    installed: list[EntryPoint],
) -> None:
    installed.append(EntryPoint("mine", MINE))
    assert list(table.chips()) == ["hmc5883l", "maxbotix", "mine"]
    addresses = [min(each.addresses) for each in table.identities()]
    assert addresses == sorted(addresses)
    assert "MINE" in {each.chip for each in table.identities()}


@pytest.mark.parametrize("loaded", [ImportError("no module named x"), 3, MINE])
def test_what_cannot_be_loaded_is_left_out_with_a_sentence(
    loaded: object, installed: list[EntryPoint], capsys: pytest.CaptureFixture[str]
) -> None:
    installed.append(EntryPoint("broken", loaded))
    assert list(table.chips()) == ["hmc5883l", "maxbotix"]
    assert "chip broken left out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("make", "wrong", "expected"),
    [
        (Ads1115, (0x47, 0x4C), "0x48 to 0x4b"),
        (Cmps12, (0x5F, 0x68), "0x60 to 0x67"),
        (Md25, (0x57, 0x60), "0x58 to 0x5f"),
        (Mpu9250, (0x67, 0x6A), "0x68, 0x69"),
        (Pca9685, (0x3F, 0x80), "0x40 to 0x7f"),
        (Srf08, (0x6F, 0x80), "0x70 to 0x7f"),
    ],
)
def test_an_address_that_a_chip_cannot_have_is_refused(
    make: Callable[[I2cBus, int], I2cChip],
    wrong: tuple[int, int],
    expected: str,
) -> None:
    for address in wrong:
        with pytest.raises(SettingError, match=f"address: 0x{address:02x}, expected {expected}"):
            make(RegisterBus(), address)
