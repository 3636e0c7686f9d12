"""What `--link` says, and what it may not say."""

from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.address import End, link_address

END = End("tachobot", "robot", has_hardware=True, timeout=1)


@pytest.mark.parametrize("text", ["", "ros3", "ros2:", "ros2:tachobot", "ros2:key=", "unix:"])
def test_what_is_no_way_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="expected"):
        link_address(text)


def test_ros_2_without_its_environment_is_refused_when_it_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_ROS_VENV", str(tmp_path))
    with pytest.raises(ConfigError, match="expected a venv with rclpy"):
        link_address("ros2")(END)


def test_a_key_for_ros_2_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(ConfigError):
        link_address(f"ros2:key={tmp_path / 'none.key'}")
