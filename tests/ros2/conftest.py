"""Real rclpy against real processes: so these tests run with the interpreter of .venv-ros."""

from collections.abc import Iterator
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from firmware_runtime.links.ros2.node import RobotNode
    from tests.support.ros_processes import RosProcesses
    from tests.support.ros_user import RosUser


def pytest_pycollect_makemodule(module_path: Path) -> None:
    """Skip what imports rclpy where there is none."""
    if find_spec("rclpy") is None:
        pytest.skip(f"{module_path.name} needs rclpy; expected .venv-ros: make test-ros")


def pytest_itemcollected(item: pytest.Item) -> None:
    """Warnings are errors, but for what rclpy's own dependencies do when they are imported."""
    item.add_marker(pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning"))


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator["RosProcesses"]:
    """Starts runs and nodes, in a domain of DDS of the test's own."""
    from tests.support.ros_processes import RosProcesses, domain  # noqa: PLC0415 -- of .venv-ros

    with ExitStack() as stack:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(stack.enter_context(domain())))
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
        yield RosProcesses(tmp_path, stack)


@pytest.fixture
def node(
    request: pytest.FixtureRequest,
    tmp_path: Path,
    robot: "RosProcesses",  # noqa: ARG001 -- has set the domain
) -> Iterator["RobotNode"]:
    """A lifecycle node in this process, started with the words of ROS that are its parameter."""
    from tests.support.parrot_node import parrot_node  # noqa: PLC0415 -- imports rclpy

    with parrot_node(tmp_path, getattr(request, "param", ())) as made:
        yield made


@pytest.fixture
def user(robot: "RosProcesses") -> Iterator["RosUser"]:  # noqa: ARG001 -- has set the domain
    """A node of the test's own, which calls services and listens."""
    from tests.support.ros_user import RosUser  # noqa: PLC0415 -- imports rclpy

    made = RosUser()
    yield made
    made.close()
