"""What the drivers' values are in ROS 2: units, axes and the words for what was not measured."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from firmware_drivers.chips.md25 import Md25Report
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.compass import CompassSettings
from firmware_drivers.ros_messages import COMPASS, INERTIAL_SAMPLE, MD25_REPORT, SONAR, VELOCITY

from firmware_runtime.board.ros.conventions import Convention, Fields
from firmware_runtime.statistics.json_values import plain

SAMPLE = InertialSample((0.1, 0.2, 9.8), (0.01, 0.02, 0.03), (2e-5, 0.0, -4e-5), 25.5, False)


def fields(convention: Convention, leaf: str, value: object, **options: float) -> Fields | None:
    (message,) = (each for each in convention.out if each.leaf == leaf)
    return message.fields(plain(value), {**convention.options, **options})


def some(convention: Convention, leaf: str, value: object, **options: float) -> Fields:
    found = fields(convention, leaf, value, **options)
    assert found is not None
    return found


def test_an_inertial_sample_is_raw_data_without_an_orientation_and_a_field_where_it_is_new() -> (
    None
):
    imu = some(INERTIAL_SAMPLE, "data_raw", SAMPLE)
    assert imu["linear_acceleration"] == {"x": 0.1, "y": 0.2, "z": 9.8}
    assert imu["angular_velocity"] == {"x": 0.01, "y": 0.02, "z": 0.03}
    assert imu["orientation_covariance"][0] == -1
    assert "orientation" not in imu
    assert some(INERTIAL_SAMPLE, "temperature", SAMPLE) == {"temperature": 25.5}
    field = some(INERTIAL_SAMPLE, "mag", SAMPLE)
    assert field == {"magnetic_field": {"x": 2e-5, "y": 0.0, "z": -4e-5}}
    assert fields(INERTIAL_SAMPLE, "mag", SAMPLE._replace(field=None)) is None


@pytest.mark.parametrize(
    ("distance", "said"),
    [
        (1.5, 1.5),
        (math.inf, math.inf),
        (6.1, math.inf),
        (0.01, -math.inf),
        (0.03, 0.03),
        (6.0, 6.0),
    ],
)
def test_a_range_says_what_is_too_far_and_too_near(distance: float, said: float) -> None:
    found = some(SONAR, "range", distance, min_range_m=0.03, max_range_m=6.0)
    assert found["range"] == said
    assert (found["min_range"], found["max_range"], found["radiation_type"]) == (0.03, 6.0, 0)
    assert math.isnan(found["field_of_view"])


def test_a_sonar_says_the_range_that_its_driver_was_set_to() -> None:
    assert SONAR.options_of is not None
    sonar: Any = SimpleNamespace(chip=SimpleNamespace(limits_m=(0.03, 6.0)))
    assert SONAR.options_of(sonar) == {"min_range_m": 0.03, "max_range_m": 6.0}


def test_a_distance_that_is_no_number_is_no_valid_range() -> None:
    assert math.isnan(some(SONAR, "range", math.nan)["range"])


@pytest.mark.parametrize(
    ("heading_deg", "clockwise", "yaw_deg"),
    [(0, 1, 90), (90, 1, 0), (180, 1, -90), (270, 1, 180), (0, 0, 90), (90, 0, 180), (270, 0, 0)],
)
def test_a_heading_is_a_yaw_from_east_anticlockwise(
    heading_deg: float, clockwise: float, yaw_deg: float
) -> None:
    quaternion = some(COMPASS, "heading", heading_deg, clockwise=clockwise)["quaternion"]
    yaw = 2 * math.atan2(quaternion["z"], quaternion["w"])
    assert math.remainder(yaw - math.radians(yaw_deg), math.tau) == pytest.approx(0, abs=1e-12)
    assert quaternion["x"] == quaternion["y"] == 0


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"settings": CompassSettings(1, counterclockwise=True)}, {"clockwise": 0.0}),
        ({"settings": CompassSettings(1)}, {}),
        ({}, {}),
    ],
)
def test_a_heading_is_clockwise_unless_its_compass_was_set_to_count_the_other_way(
    settings: dict[str, CompassSettings], said: dict[str, float]
) -> None:
    compass: Any = SimpleNamespace(**settings)
    assert COMPASS.options_of(compass) == said


def test_encoders_are_angles_of_wheels_and_nothing_else_is_made_up() -> None:
    report = Md25Report(360, -180, 12.3, 0.5, 0.6)
    joints = some(MD25_REPORT, "joint_states", report)
    assert joints["position"] == pytest.approx([math.tau, -math.pi])
    assert set(joints) == {"name", "position"}
    battery = some(MD25_REPORT, "battery_state", report)
    assert (battery["voltage"], battery["present"]) == (12.3, True)
    assert math.isnan(battery["current"])


def twist(x: float, yaw: float, y: float = 0.0) -> Any:  # noqa: ANN401
    return SimpleNamespace(
        linear=SimpleNamespace(x=x, y=y, z=0.0), angular=SimpleNamespace(x=0.0, y=0.0, z=yaw)
    )


def test_both_twists_are_a_velocity_and_a_motion_to_the_side_is_refused() -> None:
    plain_one, stamped = VELOCITY.into
    expected = {"forward_m_s": 0.5, "turn_rad_s": -1.0}
    assert plain_one.value(twist(0.5, -1.0), {}) == expected
    assert stamped.value(SimpleNamespace(twist=twist(0.5, -1.0)), {}) == expected
    with pytest.raises(ValueError, match="expected x and yaw"):
        plain_one.value(twist(0.5, 0.0, y=0.1), {})
