"""Definitions of ROS 2 messages, fields and types: of conventions, and of what is in no topic.

Source: common_interfaces 5.3 and rcl_interfaces 2.0 (Jazzy), without their comments. Those of
`firmware_runtime` are this project's own; an MCAP file brings its definitions along.
"""

from typing import Final

_COVARIANCE: Final = "float64[9]"
TRANSFER: Final = "firmware_runtime/msg/Transfer"
STEP: Final = "firmware_runtime/msg/Step"
MARKER: Final = "firmware_runtime/msg/Marker"
_FIELDS: Final[dict[str, str]] = {
    "firmware_runtime/Transfer": "string device\nstring[] messages\nuint8[] read\nstring error",
    "firmware_runtime/Step": "int64 late_ns\nint64[] readings_ns\nstring entered",
    "firmware_runtime/Marker": "string what\nstring port\nstring detail",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/Bool": "bool data",
    "std_msgs/Int64": "int64 data",
    "std_msgs/Float64": "float64 data",
    "std_msgs/String": "string data",
    "std_msgs/MultiArrayDimension": "string label\nuint32 size\nuint32 stride",
    "std_msgs/MultiArrayLayout": "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset",
    "std_msgs/Float64MultiArray": "std_msgs/MultiArrayLayout layout\nfloat64[] data",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/QuaternionStamped": "std_msgs/Header header\n"
    "geometry_msgs/Quaternion quaternion",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "sensor_msgs/Imu": "std_msgs/Header header\n"
    f"geometry_msgs/Quaternion orientation\n{_COVARIANCE} orientation_covariance\n"
    f"geometry_msgs/Vector3 angular_velocity\n{_COVARIANCE} angular_velocity_covariance\n"
    f"geometry_msgs/Vector3 linear_acceleration\n{_COVARIANCE} linear_acceleration_covariance",
    "sensor_msgs/MagneticField": "std_msgs/Header header\n"
    f"geometry_msgs/Vector3 magnetic_field\n{_COVARIANCE} magnetic_field_covariance",
    "sensor_msgs/Temperature": "std_msgs/Header header\nfloat64 temperature\nfloat64 variance",
    "sensor_msgs/Range": "uint8 ULTRASOUND=0\nuint8 INFRARED=1\nstd_msgs/Header header\n"
    "uint8 radiation_type\nfloat32 field_of_view\nfloat32 min_range\nfloat32 max_range\n"
    "float32 range\nfloat32 variance",
    "sensor_msgs/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\n"
    "float64[] velocity\nfloat64[] effort",
    "sensor_msgs/BatteryState": "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\n"
    "float32 current\nfloat32 charge\nfloat32 capacity\nfloat32 design_capacity\n"
    "float32 percentage\nuint8 power_supply_status\nuint8 power_supply_health\n"
    "uint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\n"
    "float32[] cell_temperature\nstring location\nstring serial_number",
}
_RULE: Final = "=" * 80


def definition_of(message: str) -> str | None:
    """The definition of a type such as `sensor_msgs/msg/Imu`, and of all in it; None: not known."""
    name = message.replace("/msg/", "/")
    if name not in _FIELDS:
        return None
    texts = [_FIELDS[name]]
    texts += [f"{_RULE}\nMSG: {each}\n{_FIELDS[each]}" for each in _within(name)]
    return "\n".join(texts) + "\n"


def _within(name: str) -> list[str]:
    """The types of fields, at any depth, each once."""
    found: dict[str, None] = {}
    for line in _FIELDS[name].splitlines():
        kind = line.split()[0].partition("[")[0]
        if kind in _FIELDS:
            found |= dict.fromkeys((kind, *_within(kind)))
    return list(found)
