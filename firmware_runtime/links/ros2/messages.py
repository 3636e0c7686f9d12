"""Messages of ROS by the names of their types, filled with plain fields.

rclpy writes a field into memory as what its type says, whatever it is: so every value is checked
when it is set, by a variable that the generated classes look at when they are imported.
"""

import os
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from typing import Any, Final

from firmware_runtime.devs.time import SECOND

os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"

_FLOATS: Final = ("double", "float")


@cache
def message_class(type_: str) -> Any:  # noqa: ANN401 -- ROS has no types
    """The class of a type such as `sensor_msgs/msg/Imu`. Raises ImportError or AttributeError."""
    package, _, name = type_.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def message_of(type_: str, fields: Mapping[str, Any]) -> Any:  # noqa: ANN401
    """A message with these fields; the others have their defaults.

    Raises AssertionError, AttributeError, TypeError or ValueError for a field that cannot be so.
    """
    message = message_class(type_)()
    _fill(message, fields)
    return message


def stamp(message: Any, at: int, frame: str) -> None:  # noqa: ANN401
    """Fill the header in: ns since 1970, and the frame."""
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(at, SECOND)
    message.header.frame_id = frame


def stamp_of(message: Any) -> int:  # noqa: ANN401
    """The instant in a message's header, ns since 1970; 0 if none was stated."""
    said = message.header.stamp
    return int(said.sec) * SECOND + int(said.nanosec)


def _fill(message: Any, fields: Mapping[str, Any]) -> None:  # noqa: ANN401
    types = message.get_fields_and_field_types()
    for name, value in fields.items():
        if isinstance(value, Mapping):
            _fill(getattr(message, name), value)
        else:
            setattr(message, name, _as(types.get(name, ""), value))


def _as(type_: str, value: Any) -> Any:  # noqa: ANN401
    """A value as a field of this type takes it."""
    element = type_.removeprefix("sequence<").partition("[")[0].rstrip(">").partition(",")[0]
    if not isinstance(value, list | tuple):
        return float(value) if type_ in _FLOATS else value
    if element in _FLOATS:
        return [float(each) for each in value]
    if "/" in element:
        package, name = element.split("/")
        return [message_of(f"{package}/msg/{name}", each) for each in value]
    return list(value)
