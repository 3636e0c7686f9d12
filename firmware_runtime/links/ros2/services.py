"""Three services without arguments: arm, disarm and safe_state, each with success and a message."""

import os
import sys
from typing import Any, Final

from std_srvs.srv import Trigger

from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.links.ros2.node import ARM, RobotNode
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.system.programs import ProgramFailed, run_program

SAFE_STATE_S: Final = 20.0
"""How long `safe-state` may take; it gives up by itself much sooner."""


class Services:
    """Services of one node, for as long as it lives."""

    def __init__(self, node: RobotNode) -> None:
        self._node = node
        for name, call in (
            (ARM, self._arm),
            ("disarm", self._disarm),
            ("safe_state", self._safe_state),
        ):
            node.create_service(Trigger, name, call)

    def _arm(self, _request: object, response: Any) -> object:  # noqa: ANN401 -- rclpy has no types
        """Configure the node if need be, and activate it."""
        node = self._node
        if node.phase == "unconfigured":
            node.trigger_configure()
        if node.phase == "inactive":
            node.trigger_activate()
        fault = "" if node.phase == "active" else node.refusal or f"the node is {node.phase}"
        return _answered(response, fault, "armed")

    def _disarm(self, _request: object, response: Any) -> object:  # noqa: ANN401
        """Disarm the run whatever the node's state; an active one is deactivated first."""
        node = self._node
        if node.phase == "active":
            node.trigger_deactivate()
        return _answered(response, _why_armed(node), "disarmed")

    def _safe_state(self, _request: object, response: Any) -> object:  # noqa: ANN401
        """Disarm, then do what `firmware-runtime safe-state` does."""
        node = self._node
        if node.phase == "active":
            node.trigger_deactivate()
        if _drives_nothing_outside(node):
            return _answered(response, _why_armed(node), "all outputs off: its doubles are its own")
        return _answered(response, *_switched_off(node))


def _answered(response: Any, fault: str, done: str = "") -> object:  # noqa: ANN401
    response.success = fault == ""
    response.message = fault or done
    return response


def _why_armed(node: RobotNode) -> str:
    """Disarm; why outputs may still be driven, empty if they may not."""
    try:
        answer = node.run.disarm()
    except FirmwareRuntimeError as error:
        return str(error)
    return "; ".join([*answer.get("refused", ()), *answer.get("not_safe", ())])


def _drives_nothing_outside(node: RobotNode) -> bool:
    """Return whether a run is there whose outputs are doubles of its own."""
    try:
        statistics = read_statistics(node.plan.statistics_path)
    except FirmwareRuntimeError:
        return False
    return statistics.writer_alive and "switched_off" not in statistics.header.conditions


def _switched_off(node: RobotNode) -> tuple[str, str]:
    """Run `safe-state`; what is wrong, and what it says."""
    plan = node.plan
    words = [*plan.program, "safe-state", plan.source, "--statistics", plan.statistics]
    if plan.doubles is not None:
        words += ["--doubles", plan.doubles]
    try:
        ended = run_program(words, timeout_s=SAFE_STATE_S, environment=_outer_variables())
    except ProgramFailed as error:
        return f"safe-state did not end: {error}", ""
    return ("", ended.out.strip()) if ended.status == 0 else (ended.complaint or ended.reason, "")


def _outer_variables() -> dict[str, str]:
    """The variables of a process outside of this environment."""
    own = {"_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH"}
    libraries = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    others = [each for each in libraries if each and not each.startswith(sys.prefix)]
    variables = {name: text for name, text in os.environ.items() if name not in own}
    return variables | ({"LD_LIBRARY_PATH": os.pathsep.join(others)} if others else {})
