"""Which adapters of a machine are a robot's, by what the kernel says of them."""

from pathlib import Path

import pytest

from firmware_runtime.system import device_nodes
from tests.support.fake_machines import lay_out, link


@pytest.mark.parametrize(
    ("name", "is_left_alone"),
    [
        ("bcm2835 (i2c@7e804000)", False),
        ("Synopsys DesignWare I2C adapter", False),
        ("i2c-tiny-usb at bus 001 device 002", False),
        ("i2c-gpio3", False),
        ("SMBus I801 adapter at efa0", True),
        ("SMBus PIIX4 adapter port 0 at 0b00", True),
        ("i915 gmbus dpb", True),
        ("AMDGPU DM i2c hw bus 0", True),
        ("NVIDIA i2c adapter 3 at 1:00.0", True),
        ("DPDDC-A", True),
        ("AUX A/DDI A/PHY A", True),
        ("fef04500.i2c", True),
        ("107d508280.i2c", True),
    ],
)
def test_buses_of_displays_and_mainboard_are_recognised_by_their_names(
    tmp_path: Path, name: str, *, is_left_alone: bool
) -> None:
    files = lay_out(tmp_path, {"/dev/i2c-3": "", "/sys/bus/i2c/devices/i2c-3/name": f"{name}\n"})
    assert device_nodes.adapter_name(files, "/dev/i2c-3") == name
    assert (device_nodes.not_for_robots(files, "/dev/i2c-3") is not None) is is_left_alone


def test_a_bus_that_hangs_below_a_graphics_card_is_a_displays(tmp_path: Path) -> None:
    card = "/sys/devices/pci0000:00/0000:00:02.0/drm/card0/card0-DP-1/i2c-5"
    files = lay_out(tmp_path, {"/dev/i2c-5": "", f"{card}/name": "of an unknown kind\n"})
    link(tmp_path, "/sys/bus/i2c/devices/i2c-5", tmp_path / card.lstrip("/"))
    assert "display" in (device_nodes.not_for_robots(files, "/dev/i2c-5") or "")


def test_a_bus_that_is_linked_to_a_connector_is_a_displays(tmp_path: Path) -> None:
    files = lay_out(tmp_path, {"/dev/i2c-5": "", "/sys/bus/i2c/devices/i2c-5/name": "soc:i2c\n"})
    assert device_nodes.not_for_robots(files, "/dev/i2c-5") is None
    adapter = tmp_path / "sys/bus/i2c/devices/i2c-5"
    link(tmp_path, "/sys/class/drm/card0-HDMI-A-1/ddc", adapter)
    assert "display" in (device_nodes.not_for_robots(files, "/dev/i2c-5") or "")


def test_a_held_address_comes_with_its_driver(tmp_path: Path) -> None:
    files = lay_out(tmp_path, {"/dev/i2c-1": "", "/sys/bus/i2c/drivers/inv-mpu6050-i2c/uevent": ""})
    driver = tmp_path / "sys/bus/i2c/drivers/inv-mpu6050-i2c"
    link(tmp_path, "/sys/bus/i2c/devices/1-0068/driver", driver)
    assert device_nodes.bound_addresses(files, "/dev/i2c-1") == [
        ("/dev/i2c-1", 0x68, "inv-mpu6050-i2c")
    ]
