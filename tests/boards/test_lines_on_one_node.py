"""Two buses or ports of a board file that are one device node: no clash on it would be found."""

import pytest

from firmware_runtime.board import registry
from firmware_runtime.errors import ConfigError


@pytest.mark.parametrize("node", ["/dev/i2c-1", "/dev//i2c-1"])
def test_the_second_one_is_refused(node: str) -> None:
    second = f"buses.more={{device='{node}', speed_hz=400_000}}"
    with pytest.raises(ConfigError) as refusal:
        registry.load("tachobot", [second, "imu.bus='more'"])
    (fault,) = refusal.value.faults
    assert fault.startswith("buses.more.device: ")
    assert "is that of buses.i2c1 already" in fault


def test_a_device_each_is_none() -> None:
    second = "buses.more={device='/dev/i2c-3', speed_hz=400_000}"
    registry.load("tachobot", [second, "imu.bus='more'"])
