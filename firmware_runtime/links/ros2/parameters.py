"""The gains and limits of a run as parameters of its node, each with range and description.

A parameter that is set is set in the run first, all of one request or none, and refused with the
run's own sentences. One that changes in another way (`firmware-runtime set`, a reload) is followed.
"""

import sys
from collections.abc import Sequence
from typing import Any, Final

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterValueException
from rclpy.parameter import Parameter

from firmware_runtime.board.setting_descriptions import Setting
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.links.ros2.node import Part, Refused, RobotNode

_RANGES: Final[dict[str, tuple[str, Any, type[float], float]]] = {
    "float": ("floating_point_range", FloatingPointRange, float, sys.float_info.max),
    "int": ("integer_range", IntegerRange, int, (1 << 63) - 1),
}
"""By the type of a setting: the descriptor's field, its class, its numbers, and the largest."""


class Parameters(Part):
    """There while the node is configured."""

    def __init__(self, node: RobotNode) -> None:
        self._node = node
        self._values: dict[str, object] = {}
        """What the run has."""
        self._revision = 0

    def configure(self) -> None:
        """Declare them with the run's values; an override of the command line is set in the run."""
        answer = self._node.run.ask("get")
        self._values, self._revision = answer["values"], answer["revision"]
        self._node.add_on_set_parameters_callback(self._set)
        for key, value in list(self._values.items()):
            setting = self._node.plan.settings.get(key) or Setting(type(value).__name__, "")
            try:
                self._node.declare_parameter(key, value, descriptor(setting))
            except InvalidParameterValueException as error:
                raise Refused(str(error)) from error

    def clean_up(self) -> None:
        """Undeclare them."""
        if self._set in self._node._on_set_parameters_callbacks:  # noqa: SLF001 -- it has no other name
            self._node.remove_on_set_parameters_callback(self._set)
        for key in self._values:
            if self._node.has_parameter(key):
                self._node.undeclare_parameter(key)
        self._values = {}

    def follow(self, revision: int) -> None:
        """Take over what has changed in the run."""
        if revision == self._revision:
            return
        answer = self._node.run.ask("get")
        self._values, self._revision = answer["values"], answer["revision"]
        self._node.set_parameters(
            [
                Parameter(key, value=value)
                for key, value in self._values.items()
                if self._node.has_parameter(key) and self._node.get_parameter(key).value != value
            ]
        )

    def _set(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Have the run take them up, unless that is what it has."""
        wanted = {each.name: each.value for each in parameters if each.name in self._values}
        changed = {key: value for key, value in wanted.items() if self._values[key] != value}
        if not changed:
            return SetParametersResult(successful=True)
        try:
            answer = self._node.run.ask("set", values=changed)
        except FirmwareRuntimeError as error:
            return SetParametersResult(successful=False, reason=str(error))
        if answer["refused"]:
            return SetParametersResult(successful=False, reason="; ".join(answer["refused"]))
        self._values, self._revision = answer["values"], answer["revision"]
        return SetParametersResult(successful=True)


def descriptor(setting: Setting) -> ParameterDescriptor:
    """Return what ROS shows of a setting; a bound outside of the range is in words only."""
    made = ParameterDescriptor(description=setting.text, additional_constraints=setting.range)
    low = setting.least if setting.above is None else setting.above
    high = setting.most if setting.below is None else setting.below
    if low is None and high is None:
        return made
    if setting.type in _RANGES:
        attribute, kind, number, largest = _RANGES[setting.type]
        ends = (-largest if low is None else low, largest if high is None else high)
        from_value, to_value = map(number, ends)
        setattr(made, attribute, [kind(from_value=from_value, to_value=to_value)])
    return made
