"""A sweep of an experiment: its figures in every row, as a run by hand gives them."""

import pytest
from firmware_boards.tachobot.definition import BOARD

from firmware_runtime import open_board
from firmware_runtime.lab.experiments.curve_figures import step_response
from firmware_runtime.lab.sweeps import sweep


@pytest.mark.slow
def test_a_row_has_the_figures_of_its_step() -> None:
    table = sweep(
        "tachobot", {"controller.yaw.kp": "linspace(0.5, 0.9, 2)"}, experiment="yaw-step", workers=1
    )
    changed = {**BOARD.experiments["yaw-step"].settings, "controller.yaw.kp": 0.9}
    points: list[tuple[float, float]] = []
    with open_board("tachobot", doubles=True, clock="virtual", set=changed) as robot:
        assert robot.rig is not None
        assert robot.rig.shown is not None
        robot.listen(robot.rig.shown, lambda at, yaw: points.append((at / 1e9 - 3.0, yaw)))
        robot.plan(3.0, robot.model.in_ports["yaw_reference"], 1.0)
        robot.run(13.0)
    expected = step_response(points, 0.0, 1.0)
    row = table.row(1)
    assert row["experiment.rise_s"] == expected.rise_s
    assert row["experiment.settling_s"] == expected.settling_s
    assert expected.overshoot is not None
    assert row["experiment.overshoot_percent"] == 100.0 * expected.overshoot
    assert row["experiment.is_settled"] is True
    assert table.row(0)["experiment.rise_s"] != expected.rise_s
