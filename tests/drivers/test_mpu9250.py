"""The MPU-9250's driver on bare registers: settings, bring-up, samples."""

import math
import struct

import pytest
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_burst import NO_BIAS
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings
from firmware_drivers.chips.step import duration_ns

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits, wire_bytes
from firmware_runtime.hal.wire_errors import NotReady, WrongDevice
from tests.support.bare_chip import BareChip, RegisterBus

MPU, AK = 0x68, 0x0C
IDENTITY = 0x75
ONE_G = 8192
FRESH = 0x01
Counts = tuple[int, int, int]


class Bare(BareChip[Mpu9250]):
    """An MPU-9250 with its magnetometer; `show` puts a sample into the registers."""

    def __init__(self, settings: Mpu9250Settings | None = None) -> None:
        super().__init__(lambda bus: Mpu9250(bus, settings=settings), MPU, {IDENTITY: b"\x71"})
        self.hold({0x00: b"\x48", 0x10: bytes((176, 177, 164))}, AK)

    def show(
        self,
        *,
        status: int = FRESH,
        accel: Counts = (0, 0, ONE_G),
        temperature: int = 0,
        gyro: Counts = (0, 0, 0),
        field: Counts = (100, 200, 300),
        st1: int = 0x01,
        st2: int = 0x10,
    ) -> None:
        inertial = struct.pack(">B7h", status, *accel, temperature, *gyro)
        self.hold({0x3A: inertial + struct.pack("<B3hB", st1, *field, st2)})


@pytest.fixture
def bare() -> Bare:
    return Bare()


@pytest.fixture
def ready(bare: Bare) -> Bare:
    """Return one that was brought up."""
    bare.bring_up()
    return bare


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_writes_what_it_should_in_order(ready: Bare) -> None:
    writes = [(address, sent[0]) for address, sent in ready.bus.wire if len(sent) == 1]
    assert writes == [
        *((MPU, sent) for sent in (b"\x6a\x00", b"\x6b\x80", b"\x6b\x01\x00")),
        (MPU, b"\x19\x04\x03\x08\x08\x03"),
        (MPU, b"\x37\x02\x01"),
        *((AK, sent) for sent in (b"\x0b\x01", b"\x0a\x0f", b"\x0a\x00", b"\x0a\x16")),
        (MPU, b"\x37\x00"),
        (MPU, b"\x24\x0d\x8c\x02\x88"),
        *((MPU, sent) for sent in (b"\x34\x01", b"\x67\x81", b"\x6a\x20")),
    ]
    assert ready.driver.has_magnetometer


def test_bring_up_gives_a_fetch_under_way_reset_and_gyroscope_their_time(bare: Bare) -> None:
    """Cut off within a fetch, the AK8963 may go on holding the auxiliary bus: 10 bytes, 400 kHz."""
    steps = bare.driver.bring_up()
    waits = {step.name: step.wait_ns for step in steps}
    assert [step.name for step in steps][1:3] == ["stop auxiliary master", "reset"]
    assert waits["stop auxiliary master"] >= 10 * 9 * 2500
    assert waits["reset"] == 100_000_000
    assert 35_000_000 <= waits["configure"] <= 70_000_000
    assert waits["magnetometer: measure"] >= 9_000_000
    assert duration_ns(steps) < 250_000_000


@pytest.mark.parametrize(
    ("identity", "also_accept", "warnings"),
    [
        (0x71, (), []),
        (0x73, (), []),
        (0x70, (), ["MPU-6500"]),
        (0x74, (), ["MPU-6515"]),
        (0x75, (), ["variant"]),
        (0x12, (0x12,), ["accepted by the settings"]),
    ],
)
def test_what_is_no_genuine_chip_but_compatible_or_vouched_for_is_taken_with_a_warning(
    identity: int, also_accept: tuple[int, ...], warnings: list[str]
) -> None:
    bare = Bare(Mpu9250Settings(also_accept=also_accept))
    bare.memory[IDENTITY] = identity
    bare.bring_up()
    for found, words in zip(bare.driver.warnings, warnings, strict=True):
        assert f"MPU-9250 at 0x68 on i2c-1: WHO_AM_I reads {identity:02x}" in found
        assert words in found


@pytest.mark.parametrize(
    ("identity", "who"),
    [(0x68, "MPU-6050"), (0x98, "ICM-20689"), (0x12, "unknown"), (0, "unknown")],
)
def test_another_chip_is_refused_with_its_name_before_anything_is_written(
    bare: Bare, identity: int, who: str
) -> None:
    bare.memory[IDENTITY] = identity
    with pytest.raises(WrongDevice, match=rf"reads {identity:02x}, .*{who}.*expected 71"):
        bare.bring_up()
    assert bare.bus.wire == [(MPU, (b"\x75", 1))]


def test_without_magnetometer_it_goes_on_with_six_axes_and_says_so_until_it_is_found(
    bare: Bare,
) -> None:
    with bare.silent(AK):
        bare.bring_up()
        assert not bare.driver.has_magnetometer
        (warning,) = bare.driver.warnings
        assert warning.startswith("MPU-9250 at 0x68 on i2c-1: six axes only")
        assert (b"\x6a\x20",) not in bare.sent
        bare.show()
        assert bare.driver.read_sample().field is None
        assert bare.sent[-1] == (b"\x38", 17)
    bare.bring_up()
    assert bare.driver.warnings == []
    assert bare.driver.has_magnetometer


def test_a_magnetometer_that_fails_half_way_is_left_out_and_one_that_stops_answering_is_not(
    bare: Bare,
) -> None:
    with pytest.raises(NotReady, match="read before bring-up"):
        bare.driver.read_sample()
    assert bare.bus.wire == []
    bare.hold({0x10: bytes(3)}, AK)
    bare.bring_up()
    assert not bare.driver.has_magnetometer
    assert "fuse ROM reads 00 00 00" in bare.driver.warnings[0]
    bare = Bare()
    bare.bring_up()
    assert bare.driver.check_magnetometer()
    bare.memory[0x36] = 0x01
    assert not bare.driver.check_magnetometer()
    assert bare.driver.has_magnetometer
    bare.show()
    assert bare.driver.read_sample().field is not None, "it may answer again"


def test_verify_finds_settings_that_are_gone(ready: Bare) -> None:
    ready.driver.verify()
    ready.memory[0x1B] = 0
    with pytest.raises(NotReady, match="read 04 03 00 08 03, expected 04 03 08 08 03"):
        ready.driver.verify()


# Samples ------------------------------------------------------------------------------------------


def test_a_sample_is_in_si_units(ready: Bare) -> None:
    ready.show(accel=(-4096, 0, 8192), gyro=(16384, 0, -1), temperature=3339)
    ready.bus.wire.clear()
    sample = ready.driver.read_sample()
    assert ready.sent == [(b"\x3a", 23)], "in one burst"
    assert (wire_bytes(ready.sent[0]), bits(ready.sent[0])) == (26, 237)
    assert sample.acceleration == pytest.approx((-0.5 * 9.80665, 0, 9.80665))
    assert sample.rate == pytest.approx((math.radians(250), 0, -math.radians(500 / 32768)))
    assert sample.temperature_c == pytest.approx(31.0, abs=1e-3)
    x, y, z = (0.15e-6 * (asa + 128) / 256 for asa in (176, 177, 164))
    assert sample.field == pytest.approx((200 * y, 100 * x, -300 * z))  # in the package's axes


def test_all_three_vectors_are_turned_into_the_body(ready: Bare) -> None:
    turned = Bare(Mpu9250Settings(mounting="-y +x +z"))
    turned.bring_up()
    samples = []
    for each in (turned, ready):
        each.show(accel=(1, 2, 3), gyro=(4, 5, 6), field=(7, 8, 9))
        sample = each.driver.read_sample()
        assert sample.field is not None
        samples.append((sample.acceleration, sample.rate, sample.field))
    for body, (x, y, z) in zip(*samples, strict=True):
        assert body == (-y, x, z)


def test_the_bias_of_the_body_is_taken_off_the_rate_and_off_nothing_else() -> None:
    turned = Bare(Mpu9250Settings(mounting="-y +x +z"))
    turned.bring_up()
    turned.show(accel=(1, 2, 3), gyro=(400, 500, 600))
    raw, sample = (turned.driver.read_sample(bias) for bias in (NO_BIAS, (0.01, -0.02, 0.03)))
    taken_off = [was - rate for was, rate in zip(raw.rate, sample.rate, strict=True)]
    assert taken_off == pytest.approx([0.01, -0.02, 0.03])
    assert sample._replace(rate=raw.rate) == raw


def test_a_field_that_is_missing_is_said_after_as_many_readings_as_one_that_ended(
    ready: Bare,
) -> None:
    readings = [0, 0]
    for time in range(2):
        while ready.driver.stuck_field is None:
            readings[time] += 1
            noise = readings[time]
            ready.show(accel=(noise, noise, ONE_G + noise), gyro=(noise,) * 3, st1=0)
            ready.driver.read_sample()
        ready.show()
        assert ready.driver.read_sample().field is not None
    assert readings[0] == readings[1] > 10


@pytest.mark.parametrize(
    ("st1", "st2", "overflow"),
    [
        *((0x00, 0x10, False), (0x01, 0x18, True), (0x00, 0x18, False)),
        *((0x02, 0x10, False), (0x01, 0x00, False)),
    ],
)
def test_a_field_that_is_old_or_invalid_is_none(
    ready: Bare, *, st1: int, st2: int, overflow: bool
) -> None:
    ready.show(st1=st1, st2=st2)
    sample = ready.driver.read_sample()
    assert sample.field is None
    assert sample.field_overflow == overflow
    assert sample.acceleration[2] == pytest.approx(9.80665)


ZEROS, ONES = (0, 0, 0), (-1, -1, -1)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        pytest.param(
            {"status": 0x00}, "INT_STATUS reads 00; expected a new sample", id="an old sample"
        ),
        pytest.param({"accel": ZEROS, "gyro": ZEROS}, "all read 00, expected", id="all zero"),
        pytest.param(
            {"status": 0, "accel": ZEROS, "gyro": ZEROS}, "all read 00, expected", id="held low"
        ),
        pytest.param(
            {"status": 0xFF, "accel": ONES, "temperature": -1, "gyro": ONES},
            "all read ff, expected",
            id="all one",
        ),
        pytest.param(
            {"st1": 0, "st2": 0, "field": ZEROS}, "the chip was reset since bring-up", id="reset"
        ),
    ],
)
def test_what_is_no_new_sample_is_not_given(
    ready: Bare, content: dict[str, int], reason: str
) -> None:
    ready.show(**content)  # type: ignore[arg-type] # vectors are among them
    with pytest.raises(NotReady, match=f"MPU-9250 at 0x68 on i2c-1: .*{reason}"):
        ready.driver.read_sample()


def test_all_wrong_settings_are_listed_at_once() -> None:
    settings = Mpu9250Settings(
        sample_hz=300, bandwidth_hz=42, accel_range_g=3, gyro_range_dps=501, mounting="+x +y"
    )
    assert [fault.split(":")[0] for fault in settings.faults()] == [
        "bandwidth_hz",
        "accel_range_g",
        "gyro_range_dps",
        "sample_hz",
        "mounting",
    ]
    with pytest.raises(SettingError, match="accel_range_g: 3, expected one of 2, 4, 8, 16; gyro"):
        Mpu9250(RegisterBus(), settings=settings)


@pytest.mark.parametrize("sample_hz", [0, 3, 300, 1001, -200])
def test_a_sample_rate_that_is_no_whole_division_is_refused(sample_hz: int) -> None:
    (fault,) = Mpu9250Settings(sample_hz=sample_hz).faults()
    assert fault == f"sample_hz: {sample_hz}, expected a divisor of 1000 from 4 to 1000"


@pytest.mark.parametrize(
    ("sample_hz", "samples"), [(4, 1), (100, 1), (125, 2), (200, 2), (250, 3), (1000, 10)]
)
def test_the_magnetometer_is_fetched_at_most_as_often_as_it_measures(
    sample_hz: int, samples: int
) -> None:
    settings = Mpu9250Settings(sample_hz=sample_hz)
    assert settings.faults() == ()
    assert settings.samples_a_fetch() == samples
    assert sample_hz / samples <= 100


@pytest.mark.parametrize(
    ("sample_hz", "period_ms", "readings"),
    [(200, None, 2), (1000, None, 10), (200, 10, 2), (1000, 10, 2), (1000, 20, 1), (100, 5, 1)],
)
def test_a_fetch_is_in_no_more_readings_than_are_made_meanwhile(
    sample_hz: int, period_ms: int | None, readings: int
) -> None:
    period = None if period_ms is None else period_ms * MILLISECOND
    assert Mpu9250Settings(sample_hz=sample_hz).readings_a_fetch(period) == readings


def test_settings_become_the_registers_of_the_map() -> None:
    settings = Mpu9250Settings(
        sample_hz=1000, bandwidth_hz=5, accel_range_g=16, gyro_range_dps=2000
    )
    assert settings.registers() == bytes((0x00, 0x06, 0x18, 0x18, 0x06))
