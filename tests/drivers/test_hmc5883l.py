import math
import struct

import pytest
from firmware_drivers.chips.hmc5883l import Hmc5883l, Hmc5883lSettings

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import Implausible, NoAcknowledge, NotReady, Stuck
from tests.support.bare_chip import BareChip, RegisterBus

IDLE = 0x02
PLAIN = Hmc5883lSettings()
TURNED = Hmc5883lSettings(mounting="+y -x +z", hard_iron=(0.0, 10e-6, 5e-6))


class Bare(BareChip[Hmc5883l]):
    """One that has been brought up, and what it measures."""

    def __init__(self, settings: Hmc5883lSettings = PLAIN) -> None:
        super().__init__(lambda bus: Hmc5883l(bus, settings), 0x1E, {0x0A: b"H43"})
        self.bring_up()

    def after_step(self) -> None:
        self.memory[0x02] = IDLE

    def measure(self, x: int, y: int, z: int, *, mode: int = IDLE) -> None:
        (step,) = self.driver.measurement
        step.action()
        self.hold({0x02: bytes((mode,)), 0x03: struct.pack(">3h", x, z, y)})

    def read(self) -> tuple[float, ...]:
        return self.driver.read_field()


@pytest.fixture
def bare() -> Bare:
    return Bare()


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_sets_range_and_throws_the_first_measurement_away() -> None:
    bare = Bare(Hmc5883lSettings(range_gauss=4.0))
    assert bare.sent == [(b"\x0a", 3), (b"\x00\x70\x80",), (b"\x02\x01",), (b"\x00", 9)]
    with pytest.raises(NotReady, match="no measurement to read"):
        bare.read()


@pytest.mark.parametrize(
    ("addresses", "named"),
    [
        ((0x0D,), "0x0d answers, likely a QMC5883L, which"),
        ((0x2C,), "0x2c answers, likely a QMC5883P, which"),
        ((0x0D, 0x2C), "0x0d answers, likely a QMC5883L, 0x2c answers, likely a QMC5883P"),
        ((), "expected the identity 48 34 33$"),
    ],
)
def test_a_chip_sold_under_this_name_is_named(
    bare: Bare, addresses: tuple[int, ...], named: str
) -> None:
    for address in addresses:
        bare.hold({}, address)
    with bare.silent(), pytest.raises(NoAcknowledge, match=named):
        bare.driver.identify()


# Measurements -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("range_gauss", "counts_per_gauss"),
    [
        *((0.88, 1370), (1.3, 1090), (1.9, 820), (2.5, 660)),
        *((4.0, 440), (4.7, 390), (5.6, 330), (8.1, 230)),
    ],
)
def test_counts_become_tesla_in_the_order_x_z_y(range_gauss: float, counts_per_gauss: int) -> None:
    bare = Bare(Hmc5883lSettings(range_gauss=range_gauss))
    bare.measure(x=counts_per_gauss, y=-2048, z=2047)
    expected = (1e-4, -2048e-4 / counts_per_gauss, 2047e-4 / counts_per_gauss)
    assert bare.read() == pytest.approx(expected)


@pytest.mark.parametrize("mode", [0x02, 0x03, 0x83])
def test_both_idle_codes_say_that_a_measurement_is_done(bare: Bare, mode: int) -> None:
    bare.measure(100, 0, 0, mode=mode)
    assert bare.driver.read_bearing().bearing_deg == 0.0


def test_a_measurement_under_way_is_not_ready_and_can_be_read_later(bare: Bare) -> None:
    bare.measure(100, 0, 0, mode=0x01)
    with pytest.raises(NotReady, match="MODE reads 01; expected 02 or 03"):
        bare.read()
    bare.memory[0x02] = IDLE
    assert bare.read()[0] == pytest.approx(100e-4 / 1090)


def test_a_measurement_is_read_in_one_burst_once_and_not_after_another_use(bare: Bare) -> None:
    def has_none() -> None:
        with pytest.raises(NotReady, match="no measurement to read"):
            bare.read()

    with pytest.raises(NotReady, match="no measurement to read"):
        Hmc5883l(bare.bus).read_field()
    (step,) = bare.driver.measurement
    assert 6_000_000 < step.wait_ns <= 10_000_000
    assert [each.wait_ns for each in bare.driver.bring_up() if each.wait_ns] == [step.wait_ns]
    bare.measure(100, 0, 0)
    bare.bus.wire.clear()
    bare.read()
    assert bare.sent == [(b"\x00", 9)]
    has_none()
    bare.measure(100, 0, 0)
    bare.driver.identify()
    has_none()
    bare.measure(100, 0, 0)
    with bare.silent(), pytest.raises(NoAcknowledge):
        bare.driver.measurement[0].action()
    has_none()
    bare.hold({0x03: b"\xf0\x00"})  # an overflow in the measurement thrown away does no harm
    bare.bring_up()


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_field_beyond_the_range_is_no_field(bare: Bare, axis: str) -> None:
    bare.measure(**({"x": 1, "y": 2, "z": 3} | {axis: -4096}))
    with pytest.raises(NotReady, match=rf"on sensor axis {axis}; expected .*1\.3 G"):
        bare.read()


@pytest.mark.parametrize("count", [-2049, 2048, 200 | 0x4000])
def test_counts_beyond_its_twelve_bits_are_no_field(bare: Bare, count: int) -> None:
    """A bit of the high byte that is wrong would turn the bearing by up to a right angle."""
    bare.measure(100, count, 300)
    with pytest.raises(Implausible, match=r"field y is .*, expected -2048 to 2047 counts"):
        bare.read()
    bare.measure(-2048, 2047, 300)
    bare.read()


def test_a_chip_that_lost_its_settings_is_not_read_at_another_scale(bare: Bare) -> None:
    bare.measure(100, 0, 0)
    bare.hold({0x00: b"\x10\x20"})
    with pytest.raises(NotReady, match="CRA, CRB read 10 20, expected 70 20"):
        bare.read()


# Bearings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("bearing_deg", range(0, 360, 15))
def test_the_bearing_grows_as_the_robot_turns_right(bare: Bare, bearing_deg: int) -> None:
    angle = math.radians(bearing_deg)
    bare.measure(round(2000 * math.cos(angle)), round(2000 * math.sin(angle)), -1500)
    reading = bare.driver.read_bearing()
    assert reading.bearing_deg == pytest.approx(bearing_deg, abs=0.03)
    assert 0 <= reading.bearing_deg < 360
    assert reading.calibration is None


def test_data_that_stand_still_are_stuck(bare: Bare) -> None:
    def again() -> None:
        bare.measure(x=300, y=1, z=7)
        bare.driver.read_bearing()

    for _ in range(10):
        again()
    with pytest.raises(Stuck) as caught:
        list(iter(again, again))
    assert caught.value.readings < 20
    bare.measure(x=301, y=2, z=8)
    bare.driver.read_bearing()


def test_the_mounting_turns_axes_into_the_bodys_and_there_the_robots_own_field_goes() -> None:
    bare = Bare(Hmc5883lSettings(mounting="+y -x +z"))
    bare.measure(x=-300, y=0, z=7)
    assert bare.driver.read_bearing().bearing_deg == pytest.approx(90)
    bare = Bare(TURNED)
    bare.measure(x=0, y=218, z=0)
    assert bare.read() == pytest.approx((20e-6, -10e-6, -5e-6))


def test_a_field_straight_down_has_no_bearing(bare: Bare) -> None:
    bare.measure(10, -10, -500)
    with pytest.raises(NotReady, match=r"horizontal field is 1\.3 uT; expected 2 uT or more"):
        bare.driver.read_bearing()


def test_all_settings_that_cannot_be_are_reported_at_once() -> None:
    settings = Hmc5883lSettings(range_gauss=2, mounting="up", hard_iron=(0.0, math.nan, 0.0))
    bus = RegisterBus()
    with pytest.raises(SettingError, match=r"range_gauss: 2, .*hard_iron: .*mounting: 'up'"):
        Hmc5883l(bus, settings)
    assert bus.wire == []
