import math

import pytest
from firmware_drivers.chips.bearing import in_circle
from firmware_drivers.chips.cmps12 import Cmps12

from firmware_runtime.hal.wire_errors import Implausible, NotReady, Stuck, WrongDevice
from tests.support.bare_chip import BareChip


class Bare(BareChip[Cmps12]):
    def __init__(self) -> None:
        super().__init__(lambda bus: Cmps12(bus, 0x61), 0x61, {})
        self.point(0)

    def point(self, tenths: int, *, coarse: int | None = None) -> None:
        coarse = tenths * 256 // 3600 if coarse is None else coarse
        self.hold({0: bytes((7, coarse, *tenths.to_bytes(2, "big")))})


@pytest.fixture
def bare() -> Bare:
    return Bare()


@pytest.mark.parametrize(("state", "calibration"), [(0x00, 0), (0xFC, 0), (0x32, 2), (0xFF, 3)])
def test_the_calibration_of_the_magnetometer_comes_with_it(
    bare: Bare, state: int, calibration: int
) -> None:
    bare.memory[0x1E] = state
    assert bare.driver.read_bearing().calibration == calibration


def test_a_bearing_whose_two_forms_differ_is_none(bare: Bare) -> None:
    bare.point(1800, coarse=64)
    with pytest.raises(Implausible) as caught:
        bare.driver.read_bearing()
    assert (caught.value.axis, caught.value.value) == ("bearing", 180.0)


def test_a_field_that_stands_still_is_no_bearing_until_a_bit_changes(bare: Bare) -> None:
    for _ in range(100):
        bare.driver.read_bearing()
    with pytest.raises(Stuck) as caught:
        list(map(Cmps12.read_bearing, [bare.driver] * 100))
    assert caught.value.axis == "field x, field y, field z"
    assert 100 < caught.value.readings < 200
    bare.hold({6: bytes((1, 2, 3, 4, 5, 6))})
    bare.driver.read_bearing()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        *(
            (f"07 00 {high}", "bearing reads .*; expected 0 to")
            for high in ("0e 10", "e2 e4", "ff ff")
        ),
        *((f"{byte} " * 256, f"version reads {byte}, expected 01 to fe") for byte in ("00", "ff")),
    ],
)
def test_what_cannot_be_a_bearing_is_none(bare: Bare, content: str, reason: str) -> None:
    bare.hold({0: bytes.fromhex(content)})
    with pytest.raises(NotReady, match=reason):
        bare.driver.read_bearing()


def test_bearings_are_given_to_a_tenth_and_both_ways_to_divide_the_circle_are_taken(
    bare: Bare,
) -> None:
    """A reading is two short transactions and writes nothing."""
    pairs = {(3599, 0), (0, 255)}  # across north
    for tenths in (*range(0, 3600, 97), 1, 900, 2565, 3599):
        for steps in (255, 256):
            exact = tenths * steps / 3600
            pairs |= {(tenths, int(exact)), (tenths, min(255, round(exact)))}
    for tenths, coarse in pairs:
        bare.point(tenths, coarse=coarse)
        bare.driver.identify()
        bare.bus.wire.clear()
        assert bare.driver.read_bearing().bearing_deg == tenths / 10
        assert bare.sent == [(b"\x00", 12), (b"\x1e", 1)]


@pytest.mark.parametrize(
    "found",
    [
        pytest.param("11 04 e2 e4", id="a PCA9685 on a motor board"),
        pytest.param("ff ff ff ff", id="nothing drives the bus"),
        pytest.param("00 00 00 00", id="a line is held"),
        pytest.param("07 80 00 00", id="the bearings differ"),
    ],
)
def test_what_is_no_compass_is_refused(bare: Bare, found: str) -> None:
    bare.hold({0: bytes.fromhex(found)})
    with pytest.raises(WrongDevice, match=f"registers 0 to 3 read {found}, expected"):
        bare.driver.identify()


@pytest.mark.parametrize(
    ("angle_deg", "expected"),
    [(0.0, 0.0), (360.0, 0.0), (-90.0, 270.0), (725.0, 5.0), (-1e-20, 0.0)],
)
def test_an_angle_is_brought_into_the_circle(angle_deg: float, expected: float) -> None:
    assert in_circle(angle_deg) == expected
    assert not math.isclose(in_circle(angle_deg), 360.0)
