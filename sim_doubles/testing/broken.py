"""Assertions about a robot on whose doubles something was broken.

with open_board("tachobot", doubles=True, clock="virtual", faults=FAULTS) as robot:
robot.run(4.0)
assert_noticed(robot)
assert_ends_off(robot)
"""

from firmware_runtime.devs.time import SECOND
from firmware_runtime.runs.open_board import OpenBoard


def noticed(robot: OpenBoard) -> str | None:
    """Return what a robot did about the faults so far, in words; None where it did nothing.

    That is where a model has reported a fault since the first of them, or all outputs are off.
    """
    first_s = min((each.at for each in robot.struck), default=0) / SECOND
    said = [
        f"{model}: {kind}"
        for model, kinds in robot.statistics.faults.items()
        for kind, figures in kinds.items()
        if figures.last_s is not None and figures.last_s >= first_s
    ]
    if robot.outputs and not any(robot.outputs.values()):
        said.append("all outputs are off")
    return ", ".join(said) or None


def assert_noticed(robot: OpenBoard) -> None:
    """Fail the test whose robot drives on as if nothing was broken."""
    __tracebackhide__ = True
    if noticed(robot) is None:
        made = ", ".join(f"{each.kind} of {each.device or 'all'}" for each in robot.struck)
        on = {chip: count for chip, count in (robot.outputs or {}).items() if count}
        raise AssertionError(f"no fault was reported after {made}, and outputs are on: {on}")


def assert_ends_off(robot: OpenBoard) -> None:
    """End all faults and the run; fail the test if an output is on then."""
    __tracebackhide__ = True
    robot.clear_faults()
    robot.close()
    on = {chip: count for chip, count in (robot.outputs or {}).items() if count}
    if on:
        raise AssertionError(f"outputs are on after the end: {on}; expected none")
