"""How the interpreter of a ROS environment is found and started, and what it cannot start with."""

import os
import subprocess
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.ros2 import interpreter
from firmware_runtime.links.ros2.interpreter import (
    PLACE,
    check_surroundings,
    command_of,
    find_environment,
    python_of,
    variables_of,
)
from firmware_runtime.links.ros2.plan import Plan, read_plan


@pytest.fixture
def environment(tmp_path: Path) -> Path:
    """A folder with a program where a venv has its interpreter; it prints what it is given."""
    folder = tmp_path / "ros"
    python = python_of(folder)
    python.parent.mkdir(parents=True)
    python.write_text('#!/bin/sh\necho "$FROM_SETUP" "$@"\n')
    python.chmod(0o755)
    return folder


def with_wheels(environment: Path) -> Path:
    packages = environment / "lib/python3.11/site-packages"
    (packages / "ros_rcl.libs").mkdir(parents=True)
    (packages / "ros_wheels_bootstrapper.pth").write_text("")
    return environment


def test_one_that_is_named_is_taken(environment: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert find_environment(environment) == environment
    monkeypatch.setenv(PLACE, str(environment))
    assert find_environment(None) == environment


def test_one_that_is_none_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError):
        find_environment(tmp_path)
    monkeypatch.setenv(PLACE, str(tmp_path))
    with pytest.raises(ConfigError):
        find_environment(None)


def test_wheels_get_their_libraries_and_no_second_start(environment: Path) -> None:
    variables = variables_of(with_wheels(environment), {"LD_LIBRARY_PATH": "/mine", "A": "b"})
    libraries = variables["LD_LIBRARY_PATH"].split(os.pathsep)
    packages = environment / "lib/python3.11/site-packages"
    assert libraries == [str(environment / "lib"), str(packages / "ros_rcl.libs"), "/mine"]
    assert variables["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] == "1"
    assert variables["A"] == "b"


def test_an_installed_ros_is_sourced_first(
    environment: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = tmp_path / "setup.sh"
    setup.write_text("export FROM_SETUP=sourced\n")
    monkeypatch.setattr(interpreter, "SETUP", str(setup))
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    words = command_of(environment, ["-m", "a b"])
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout == "sourced -m a b\n"
    assert variables_of(environment, {"A": "b"}) == {"A": "b"}


def test_one_that_was_sourced_is_not_sourced_again(
    environment: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interpreter, "SETUP", str(tmp_path))
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/jazzy")
    assert command_of(environment, ["x"]) == [str(python_of(environment)), "x"]


@pytest.mark.parametrize(
    ("board", "node"), [("tachobot", "tachobot"), ("left-rover", "left_rover"), ("3x", "robot_3x")]
)
def test_a_node_is_named_after_its_robot_as_ros_allows_it(board: str, node: str) -> None:
    plan = Plan(board=board, source=board, statistics="/x/y.stats", program=("p",))
    assert plan.node == node
    assert read_plan(plan.written()) == plan


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
