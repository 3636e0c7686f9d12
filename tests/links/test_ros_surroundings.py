"""What a process of ROS would end of without a sentence is refused in one."""

from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.ros2.interpreter import check_surroundings


@pytest.mark.parametrize("domain", ["", "0", "7", "232"])
def test_a_domain_that_ros_has_is_taken(domain: str) -> None:
    check_surroundings({"ROS_DOMAIN_ID": domain})
    check_surroundings({})


@pytest.mark.parametrize("domain", ["text", "500", "233", "-1", "010", "0x7", " 7", "9" * 99, "٣"])
def test_a_domain_that_ros_has_not_or_takes_for_another_is_refused(domain: str) -> None:
    with pytest.raises(ConfigError, match="expected a number from 0 to 232"):
        check_surroundings({"ROS_DOMAIN_ID": domain})


def test_shared_memory_that_is_full_is_refused_together_with_the_domain(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as refused:
        check_surroundings({"ROS_DOMAIN_ID": "x"}, tmp_path, room=1 << 70)
    assert len(refused.value.faults) == 2
    assert f"{tmp_path}: " in refused.value.faults[1]
    check_surroundings({}, tmp_path, room=0)
    check_surroundings({}, tmp_path / "none", room=1 << 70)
