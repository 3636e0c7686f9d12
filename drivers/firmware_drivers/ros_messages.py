"""Messages of ROS 2 for these drivers' values: axes and units of REP-103, ranges of REP-117.

Imu's sample (any port of InertialSample)   imu/data_raw, imu/mag, imu/temperature (REP-145)
Sonar's distance                            NAME/range
Compass's heading_deg                       NAME/heading
Md25Report                                  joint_states, battery_state
an input port of Velocity                   cmd_vel
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, Final

from firmware_drivers.chips.md25 import Md25Report
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.compass import Compass
from firmware_drivers.differential_drive import Velocity
from firmware_drivers.sonar import Sonar
from firmware_runtime.board.ros.conventions import (
    Convention,
    Fields,
    Incoming,
    Options,
    Outgoing,
    finite,
)
from firmware_runtime.devs.component import Component

UNKNOWN: Final = float("nan")
_NOT_ESTIMATED: Final = [-1.0, *[0.0] * 8]
"""A covariance that says that its value is none (REP-145); zeros say that it is not known."""
ULTRASOUND: Final = 0
"""`radiation_type` of a sonar's Range."""
EMG30_COUNTS_PER_TURN: Final = 360.0
_stamped: Final = partial(Outgoing, is_stamped=True)


def _vector(values: Sequence[float]) -> Fields:
    return dict(zip("xyz", map(float, values), strict=True))


def _imu(sample: Any, _options: Options) -> Fields:  # noqa: ANN401 -- as JSON shows it
    return {
        "orientation_covariance": _NOT_ESTIMATED,
        "angular_velocity": _vector(sample["rate"]),
        "linear_acceleration": _vector(sample["acceleration"]),
    }


def _field(sample: Any, _options: Options) -> Fields | None:  # noqa: ANN401
    """None where there is no new measurement: an old one is not sent again."""
    field = sample["field"]
    return None if field is None else {"magnetic_field": _vector(field)}


def _temperature(sample: Any, _options: Options) -> Fields:  # noqa: ANN401
    return {"temperature": float(sample["temperature_c"])}


INERTIAL_SAMPLE: Final = Convention(
    of=InertialSample,
    base="imu",
    out=(
        _stamped(type="sensor_msgs/msg/Imu", leaf="data_raw", fields=_imu),
        _stamped(type="sensor_msgs/msg/MagneticField", leaf="mag", fields=_field),
        _stamped(type="sensor_msgs/msg/Temperature", leaf="temperature", fields=_temperature),
    ),
)


# Sonar --------------------------------------------------------------------------------------------


def _range(distance: Any, options: Options) -> Fields:  # noqa: ANN401
    """REP-117: +inf nothing within range, -inf too near to measure, NaN no valid measurement."""
    measured, least, most = float(distance), options["min_range_m"], options["max_range_m"]
    if measured > most:
        measured = math.inf
    elif measured < least:
        measured = -math.inf
    return {
        "radiation_type": ULTRASOUND,
        "field_of_view": options["field_of_view_rad"],
        "min_range": least,
        "max_range": most,
        "range": measured,
    }


def _limits(sonar: Component) -> Options:
    """The farthest that this sonar was set to measure, where its driver has such a setting."""
    limits = getattr(getattr(sonar, "chip", None), "limits_m", None)
    return {} if limits is None else {"min_range_m": limits[0], "max_range_m": limits[1]}


SONAR: Final = Convention(
    of=Sonar,
    port="distance",
    out=(_stamped(type="sensor_msgs/msg/Range", leaf="range", fields=_range),),
    options={"field_of_view_rad": UNKNOWN, "min_range_m": 0.0, "max_range_m": math.inf},
    options_of=_limits,
)


# Compass ------------------------------------------------------------------------------------------


def _heading(heading_deg: Any, options: Options) -> Fields:  # noqa: ANN401
    """Yaw of REP-103: zero is east and it grows anticlockwise; a heading's zero is north."""
    sense = -1.0 if options["clockwise"] else 1.0
    half = (math.pi / 2 + sense * math.radians(finite(float(heading_deg), "heading"))) / 2
    return {"quaternion": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}}


def _sense(compass: Component) -> Options:
    settings = getattr(compass, "settings", None)
    return {"clockwise": 0.0} if getattr(settings, "counterclockwise", False) else {}


COMPASS: Final = Convention(
    of=Compass,
    port="heading_deg",
    out=(
        _stamped(
            type="geometry_msgs/msg/QuaternionStamped", leaf="heading", fields=_heading, frame="map"
        ),
    ),
    options={"clockwise": 1.0},
    options_of=_sense,
)


# Treads -------------------------------------------------------------------------------------------


def _joints(report: Any, options: Options) -> Fields:  # noqa: ANN401
    """Angles since power-up in rad; velocity and effort were not measured and are left out."""
    turn = math.tau / options["counts_per_turn"]
    return {
        "name": ["left_wheel_joint", "right_wheel_joint"],
        "position": [report["left_encoder"] * turn, report["right_encoder"] * turn],
    }


def _battery(report: Any, _options: Options) -> Fields:  # noqa: ANN401
    """Its voltage; the currents are the motors' alone, so the battery's is not known."""
    unknown = ("temperature", "current", "charge", "capacity", "design_capacity", "percentage")
    return {
        **dict.fromkeys(unknown, UNKNOWN),
        "voltage": float(report["battery_v"]),
        "present": True,
    }


MD25_REPORT: Final = Convention(
    of=Md25Report,
    base="",
    out=(
        _stamped(type="sensor_msgs/msg/JointState", leaf="joint_states", fields=_joints),
        _stamped(type="sensor_msgs/msg/BatteryState", leaf="battery_state", fields=_battery),
    ),
    options={"counts_per_turn": EMG30_COUNTS_PER_TURN},
)


def _twist(twist: Any, _options: Options) -> object:  # noqa: ANN401 -- any message with its fields
    """Raises ValueError for a motion that a vehicle with two treads cannot make."""
    linear, angular = twist.linear, twist.angular
    if linear.y or linear.z or angular.x or angular.y:
        raise ValueError("linear y and z, angular x and y are not all zero; expected x and yaw")
    return {"forward_m_s": linear.x, "turn_rad_s": angular.z}


def _velocity(velocity: Any, _options: Options) -> Fields:  # noqa: ANN401
    return {
        "linear": {"x": float(velocity["forward_m_s"])},
        "angular": {"z": float(velocity["turn_rad_s"])},
    }


VELOCITY: Final = Convention(
    of=Velocity,
    base="cmd_vel",
    out=(Outgoing(type="geometry_msgs/msg/Twist", fields=_velocity),),
    into=(
        Incoming(type="geometry_msgs/msg/Twist", value=_twist),
        Incoming(
            type="geometry_msgs/msg/TwistStamped",
            value=lambda stamped, options: _twist(stamped.twist, options),
            is_stamped=True,
        ),
    ),
)
