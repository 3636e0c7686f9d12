import math
import struct
from collections.abc import Callable
from typing import TypeAlias

import pytest
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings
from firmware_drivers.chips.step import duration_ns

from firmware_runtime.hal.budget import bits, wire_bytes
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, WrongDevice

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]
Registers: TypeAlias = dict[int, bytearray]

MPU = 0x68
AK = 0x0C
ONE_G = 8192
FRESH = 0x01


@pytest.fixture
def registers() -> Registers:
    mpu, magnetometer = bytearray(256), bytearray(256)
    mpu[0x75] = 0x71
    magnetometer[0x00] = 0x48
    magnetometer[0x10:0x13] = bytes((176, 177, 164))
    return {MPU: mpu, AK: magnetometer}


@pytest.fixture
def chip(register_bus: I2cBus) -> Mpu9250:
    return Mpu9250(register_bus)


@pytest.fixture
def show(registers: Registers) -> Callable[..., None]:
    """Put a sample into the registers, raw counts as the chip would show them."""

    def show(
        *,
        status: int = FRESH,
        accel: tuple[int, int, int] = (0, 0, ONE_G),
        temperature: int = 0,
        gyro: tuple[int, int, int] = (0, 0, 0),
        field: tuple[int, int, int] = (100, 200, 300),
        st1: int = 0x01,
        st2: int = 0x10,
    ) -> None:
        inertial = struct.pack(">B7h", status, *accel, temperature, *gyro)
        registers[MPU][0x3A:0x51] = inertial + struct.pack("<B3hB", st1, *field, st2)

    return show


def bring_up(chip: Mpu9250) -> None:
    for step in chip.bring_up():
        step.action()


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_writes_what_it_should_in_order(chip: Mpu9250, wire: Wire) -> None:
    bring_up(chip)
    writes = [(address, sent[0]) for address, sent in wire if len(sent) == 1]
    assert writes == [
        (MPU, b"\x6a\x00"),
        (MPU, b"\x6b\x80"),
        (MPU, b"\x6b\x01\x00"),
        (MPU, b"\x19\x04\x03\x08\x08\x03"),
        (MPU, b"\x37\x02\x01"),
        (AK, b"\x0b\x01"),
        (AK, b"\x0a\x0f"),
        (AK, b"\x0a\x00"),
        (AK, b"\x0a\x16"),
        (MPU, b"\x37\x00"),
        (MPU, b"\x24\x0d\x8c\x02\x88"),
        (MPU, b"\x34\x01"),
        (MPU, b"\x67\x81"),
        (MPU, b"\x6a\x20"),
    ]
    assert chip.has_magnetometer
    assert chip.warnings == []


def test_a_fetch_under_way_has_its_time_to_end_before_the_reset(chip: Mpu9250) -> None:
    """Cut off within a fetch, the AK8963 may go on holding the auxiliary bus: 10 bytes, 400 kHz."""
    _, stop_master, reset, *_ = chip.bring_up()
    assert (stop_master.name, reset.name) == ("stop auxiliary master", "reset")
    assert stop_master.wait_ns >= 10 * 9 * 2500


def test_bring_up_gives_reset_and_gyroscope_their_time(chip: Mpu9250) -> None:
    steps = chip.bring_up()
    waits = {step.name: step.wait_ns for step in steps}
    assert waits["reset"] == 100_000_000
    assert 35_000_000 <= waits["configure"] <= 70_000_000
    assert waits["magnetometer: measure"] >= 9_000_000
    assert duration_ns(steps) < 250_000_000


@pytest.mark.parametrize("identity", [0x71, 0x73])
def test_a_genuine_chip_gives_no_warning(
    chip: Mpu9250, registers: Registers, identity: int
) -> None:
    registers[MPU][0x75] = identity
    bring_up(chip)
    assert chip.warnings == []


@pytest.mark.parametrize(
    ("identity", "who"), [(0x70, "MPU-6500"), (0x74, "MPU-6515"), (0x75, "variant")]
)
def test_a_compatible_clone_is_taken_with_a_warning(
    chip: Mpu9250, registers: Registers, identity: int, who: str
) -> None:
    registers[MPU][0x75] = identity
    bring_up(chip)
    (warning,) = chip.warnings
    assert f"MPU-9250 at 0x68 on i2c-1: WHO_AM_I reads {identity:02x}" in warning
    assert who in warning


@pytest.mark.parametrize(
    ("identity", "who"),
    [(0x68, "MPU-6050"), (0x98, "ICM-20689"), (0x12, "unknown"), (0, "unknown")],
)
def test_another_chip_is_refused_with_its_name_before_anything_is_written(
    chip: Mpu9250, registers: Registers, wire: Wire, identity: int, who: str
) -> None:
    registers[MPU][0x75] = identity
    expected = rf"MPU-9250 at 0x68 on i2c-1: WHO_AM_I reads {identity:02x}, .*{who}.*expected 71"
    with pytest.raises(WrongDevice, match=expected):
        bring_up(chip)
    assert wire == [(MPU, (b"\x75", 1))]


def test_an_unknown_identity_is_taken_when_the_settings_vouch_for_it(
    register_bus: I2cBus, registers: Registers
) -> None:
    registers[MPU][0x75] = 0x12
    chip = Mpu9250(register_bus, settings=Mpu9250Settings(also_accept=(0x12,)))
    bring_up(chip)
    assert chip.warnings == [
        "MPU-9250 at 0x68 on i2c-1: WHO_AM_I reads 12, accepted by the settings"
    ]


def test_an_absent_chip_says_what_was_expected(chip: Mpu9250, registers: Registers) -> None:
    del registers[MPU]
    with pytest.raises(NoAcknowledge, match="MPU-9250 at 0x68 on i2c-1: no answer; expected WHO"):
        bring_up(chip)


def test_without_magnetometer_it_goes_on_with_six_axes_and_says_so(
    chip: Mpu9250, registers: Registers, wire: Wire, show: Callable[..., None]
) -> None:
    del registers[AK]
    bring_up(chip)
    assert not chip.has_magnetometer
    (warning,) = chip.warnings
    assert warning.startswith("MPU-9250 at 0x68 on i2c-1: six axes only, without field: AK8963")
    assert (MPU, (b"\x6a\x20",)) not in wire
    show()
    assert chip.read_sample().field is None
    assert wire[-1] == (MPU, (b"\x38", 17))


def test_a_magnetometer_that_fails_half_way_is_left_out(
    chip: Mpu9250, registers: Registers
) -> None:
    registers[AK][0x10:0x13] = bytes(3)
    bring_up(chip)
    assert not chip.has_magnetometer
    assert "fuse ROM reads 00 00 00" in chip.warnings[0]


def test_bringing_up_again_forgets_old_warnings_and_finds_the_magnetometer(
    chip: Mpu9250, registers: Registers
) -> None:
    magnetometer = registers.pop(AK)
    bring_up(chip)
    registers[AK] = magnetometer
    bring_up(chip)
    assert chip.warnings == []
    assert chip.has_magnetometer


def test_verify_says_what_was_found_and_expected(chip: Mpu9250, registers: Registers) -> None:
    bring_up(chip)
    chip.verify()
    registers[MPU][0x1B] = 0
    with pytest.raises(
        NotReady, match="read 04 03 00 08 03, expected 04 03 08 08 03; it was reset"
    ):
        chip.verify()


# Samples ------------------------------------------------------------------------------------------


def test_a_sample_is_one_burst_of_26_bytes(
    chip: Mpu9250, wire: Wire, show: Callable[..., None]
) -> None:
    bring_up(chip)
    show()
    wire.clear()
    chip.read_sample()
    assert wire == [(MPU, (b"\x3a", 23))]
    assert wire_bytes(wire[0][1]) == 26
    assert bits(wire[0][1]) == 237


def test_a_sample_is_in_si_units(chip: Mpu9250, show: Callable[..., None]) -> None:
    bring_up(chip)
    show(accel=(-4096, 0, 8192), gyro=(16384, 0, -1), temperature=3339)
    sample = chip.read_sample()
    assert sample.acceleration == pytest.approx((-0.5 * 9.80665, 0, 9.80665))
    assert sample.rate == pytest.approx((math.radians(250), 0, -math.radians(500 / 32768)))
    assert sample.temperature_c == pytest.approx(31.0, abs=1e-3)


def test_the_field_is_in_tesla_adjusted_and_turned_into_the_packages_axes(
    chip: Mpu9250, show: Callable[..., None]
) -> None:
    bring_up(chip)
    show(field=(100, 200, 300))
    x, y, z = (0.15e-6 * (asa + 128) / 256 for asa in (176, 177, 164))
    assert chip.read_sample().field == pytest.approx((200 * y, 100 * x, -300 * z))


def test_all_three_vectors_are_turned_into_the_body(
    register_bus: I2cBus, show: Callable[..., None]
) -> None:
    chip = Mpu9250(register_bus, settings=Mpu9250Settings(mounting="-y +x +z"))
    straight = Mpu9250(register_bus)
    bring_up(chip)
    bring_up(straight)
    show(accel=(1, 2, 3), gyro=(4, 5, 6), field=(7, 8, 9))
    body, sensor = chip.read_sample(), straight.read_sample()
    assert sensor.field is not None
    assert body.field is not None
    pairs = (
        (body.acceleration, sensor.acceleration),
        (body.rate, sensor.rate),
        (body.field, sensor.field),
    )
    for turned, (x, y, z) in pairs:
        assert turned == (-y, x, z)


@pytest.mark.parametrize(
    ("st1", "st2", "overflow"),
    [(0x00, 0x10, False), (0x01, 0x18, True), (0x02, 0x10, False), (0x01, 0x00, False)],
)
def test_a_field_that_is_old_or_invalid_is_none(
    chip: Mpu9250, show: Callable[..., None], *, st1: int, st2: int, overflow: bool
) -> None:
    bring_up(chip)
    show(st1=st1, st2=st2)
    sample = chip.read_sample()
    assert sample.field is None
    assert sample.field_overflow == overflow
    assert sample.acceleration[2] == pytest.approx(9.80665)


def test_an_old_sample_is_never_given_as_new(chip: Mpu9250, show: Callable[..., None]) -> None:
    bring_up(chip)
    show(status=0x00)
    with pytest.raises(NotReady, match="INT_STATUS reads 00; expected a new sample"):
        chip.read_sample()


@pytest.mark.parametrize(("status", "value"), [(0x01, 0), (0x00, 0), (0xFF, -1)])
def test_bytes_that_are_all_zero_or_all_one_are_a_fault_not_data(
    chip: Mpu9250, show: Callable[..., None], status: int, value: int
) -> None:
    bring_up(chip)
    still = (value, value, value)
    show(status=status, accel=still, temperature=value, gyro=still)
    with pytest.raises(NotReady, match=r"MPU-9250 at 0x68 on i2c-1: .* all read (00|ff), expected"):
        chip.read_sample()


def test_a_chip_reset_behind_our_back_is_reported_by_its_auxiliary_data(
    chip: Mpu9250, show: Callable[..., None]
) -> None:
    bring_up(chip)
    show(st1=0, st2=0, field=(0, 0, 0))
    with pytest.raises(NotReady, match="the chip was reset since bring-up"):
        chip.read_sample()


def test_reading_before_bring_up_is_refused(chip: Mpu9250, wire: Wire) -> None:
    with pytest.raises(NotReady, match="read before bring-up"):
        chip.read_sample()
    assert wire == []


def test_a_magnetometer_that_stopped_answering_is_reported_when_asked(
    chip: Mpu9250, registers: Registers
) -> None:
    bring_up(chip)
    assert chip.check_magnetometer()
    registers[MPU][0x36] = 0x01
    assert not chip.check_magnetometer()
    assert "its AK8963 stopped answering" in chip.warnings[-1]
