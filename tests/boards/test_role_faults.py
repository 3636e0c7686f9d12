"""What is wrong in the tables [roles] and [link] is named, all of it, with its key."""

import pytest

from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.ends import role_without_hardware
from firmware_runtime.board.registry import load
from firmware_runtime.board.robot import Robot
from firmware_runtime.board.settings import BoardSettings
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.errors import ConfigError, SettingError


def faults_of(*assignments: str) -> tuple[str, ...]:
    with pytest.raises(ConfigError) as refused:
        load("tachobot", assignments)
    return refused.value.faults


def test_all_boards_roles_are_sound() -> None:
    assert load("tachobot").settings.link.retain == ("esc.armed",)
    assert load("tachobot", ["controller.mode='free'"]).settings.roles
    assert load("detective").settings.roles


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ('roles.robot=["imu", "wings"]', "roles.robot: 'wings'"),
        ('roles.left=["imu"]', "roles.left: 'imu' is in roles.robot already"),
        ('roles.robot=["imu", "imu"]', "'imu' is named twice"),
        ("roles.left=[]", "roles.left: names no component"),
        ('roles."Left one"=["controller"]', "roles"),
        ('link.retain=["imu.fault"]', "link.retain: 'imu.fault' crosses no cut"),
        ('link.limits={"imu.fault"=[0.0, 1.0]}', "link.limits: 'imu.fault' crosses no cut"),
        ('link.limits={"controller.forces"=[1.0, -1.0]}', "link.limits.controller.forces"),
        ('link.limits={"controller.forces"=[-inf, 1.0]}', "link.limits"),
        ("link.timeout_s=0.0", "link.timeout_s"),
        ("link.keep=0", "link.keep"),
    ],
)
def test_it_is_named(assignment: str, words: str) -> None:
    assert any(words in fault for fault in faults_of(assignment))


def test_a_port_of_a_component_is_no_component() -> None:
    with pytest.raises(ConfigError) as refused:
        load("detective", ['roles.robot=["treads", "model.Out4"]'])
    (fault,) = refused.value.faults
    assert fault.startswith("roles.robot: 'model.Out4': expected some of ")
    assert fault.count("model.Out4") == 1


def test_that_nothing_crosses_a_cut_is_said() -> None:
    everything = ["imu", "thrust_pairs", "esc", "lift", "position_input", "controller"]
    (fault,) = faults_of(f"roles.robot={everything}", "link.retain=[]")
    assert fault.endswith("crosses no cut between roles; expected none, as nothing does")


def test_all_of_it_at_once() -> None:
    limits = 'link.limits={"controller.forces"=[1.0, -1.0]}'
    assert len(faults_of('roles.robot=["wings"]', "roles.left=[]", limits)) == 3


def test_optional_components_are_names() -> None:
    def build(_settings: object, _lines: object) -> Robot:
        return Robot(Coupled("none"), (), ())

    with pytest.raises(SettingError, match="optional_components"):
        BoardDefinition(settings=BoardSettings, build=build, optional_components="esc")


@pytest.mark.parametrize(
    ("assignment", "role"),
    [
        ([], "controller"),
        (['roles.mind=["controller"]'], "mind"),
        (['roles={mind=["controller"]}'], "mind"),
    ],
)
def test_the_role_without_hardware_goes_by_any_name(assignment: list[str], role: str) -> None:
    assert role_without_hardware(load("tachobot", assignment)) == role


def test_a_cut_that_leaves_hardware_at_both_ends_has_no_such_role() -> None:
    with pytest.raises(ConfigError, match="hardware at both ends"):
        role_without_hardware(load("tachobot", ['roles={eye=["imu"]}', "link={}"]))
