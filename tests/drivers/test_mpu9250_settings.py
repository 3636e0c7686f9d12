import pytest
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings

from firmware_runtime.errors import SettingError
from tests.support.bare_chip import RegisterBus


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


def test_settings_become_the_registers_of_the_map() -> None:
    settings = Mpu9250Settings(
        sample_hz=1000, bandwidth_hz=5, accel_range_g=16, gyro_range_dps=2000
    )
    assert settings.registers() == bytes((0x00, 0x06, 0x18, 0x18, 0x06))
