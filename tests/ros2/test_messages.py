"""What each convention says of a value is a message that ROS has, with these fields."""

import math
from typing import Any

import pytest
from firmware_drivers.chips.md25 import Md25Report
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.differential_drive import Velocity

from firmware_runtime.board.ros.conventions import Convention, conventions
from firmware_runtime.board.ros.plain_types import plain_convention
from firmware_runtime.links.ros2.messages import message_of, stamp, stamp_of
from firmware_runtime.models.motion import Motion
from firmware_runtime.statistics.json_values import plain

SAMPLE = InertialSample((0, 0.2, 9.8), (0.01, 0.02, 0.03), (2e-5, 0.0, -4e-5), 25, False)
VALUES: dict[str, list[object]] = {
    "compass": [0, 359.5],
    "inertial_sample": [SAMPLE, SAMPLE._replace(field=None)],
    "md25_report": [Md25Report(360, -180, 12.3, 0.5, 0.6)],
    "motion": [Motion(1.0, -2.0)],
    "sonar": [1.5, 0.0, math.inf, math.nan],
    "velocity": [Velocity(0.5, 1)],
}


def made(convention: Convention, value: object) -> list[Any]:
    found = []
    for each in convention.out:
        fields = each.fields(plain(value), convention.options)
        if fields is not None:
            message = message_of(each.type, fields)
            if each.is_stamped:
                stamp(message, 5_000_000_007, "somewhere")
                assert stamp_of(message) == 5_000_000_007
            found.append(message)
    return found


def test_every_convention_that_comes_with_the_project_makes_messages() -> None:
    assert set(VALUES) == set(conventions())
    for name, values in VALUES.items():
        for value in values:
            assert made(conventions()[name], value), name


@pytest.mark.parametrize("value", [True, -5, 0.25, "text", (1, 2.0, None), Motion(0.0, math.inf)])
def test_plain_values_make_messages(value: object) -> None:
    convention = plain_convention(type(value))
    assert convention is not None
    (message,) = made(convention, value)
    if isinstance(value, tuple):
        assert len(message.data) == len(value) == message.layout.dim[0].size
    else:
        assert message.data == value


def test_a_field_that_a_message_does_not_have_is_no_message() -> None:
    with pytest.raises(AttributeError):
        message_of("std_msgs/msg/Float64", {"date": 1.0})
    with pytest.raises((AssertionError, TypeError, ValueError)):
        message_of("std_msgs/msg/Int64", {"data": 0.5})
