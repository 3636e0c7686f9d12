"""`/diagnostics`: the numbers of `stats --json`, and levels."""

import json
import signal
import subprocess
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray

from firmware_runtime.links.ros2.judgement import flat
from tests.ros2.test_lifecycle import started
from tests.support.ros_processes import PYTHON, RosProcesses
from tests.support.ros_user import RosUser
from tests.support.waiting import wait_until

ERROR, STALE = bytes([2]), bytes([3])

GROWING = {"scheduled", "waiting", "load"}
"""What a reader goes on counting while the loop stands still: activations are due all the same."""


class Listener:
    """What came on /diagnostics, the newest last."""

    def __init__(self, user: RosUser) -> None:
        self.arrays: list[DiagnosticArray] = []
        self._user = user
        user.node.create_subscription(DiagnosticArray, "/diagnostics", self.arrays.append, 10)

    def next(self, count: int = 1) -> dict[str, Any]:
        """The statuses of the message that is `count` on from here, by name."""
        wanted = len(self.arrays) + count
        self._user.spin_until(lambda: len(self.arrays) >= wanted, "diagnostics came")
        return {each.name: each for each in self.arrays[-1].status}


def stats(robot: RosProcesses) -> dict[str, Any]:
    words = [PYTHON, "-m", "firmware_runtime.cli", "stats", "--json"]
    done = subprocess.run(
        [*words, "--statistics", str(robot.statistics)], capture_output=True, text=True, check=True
    )
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_they_are_the_numbers_of_stats(robot: RosProcesses, user: RosUser) -> None:
    run = started(robot)
    robot.node()
    received = Listener(user)
    assert received.next()["tachobot: run"].hardware_id == "tachobot"
    run.send_signal(signal.SIGSTOP)  # so that both are read at one moment
    wait_until(
        lambda: "stands still" in received.next()["tachobot: run"].message, "it stands still"
    )
    statuses, printed = received.next(), stats(robot)
    assert statuses["tachobot: run"].level == ERROR
    for path, model in printed["models"].items():
        said = {each.key: each.value for each in statuses[f"tachobot: {path}"].values}
        expected = dict(flat({**model, "faults": printed["faults"].get(path, {})}))
        assert said.keys() == expected.keys()
        assert {key: said[key] for key in said.keys() - GROWING} == {
            key: expected[key] for key in expected.keys() - GROWING
        }
    said = {each.key: each.value for each in statuses["tachobot: run"].values}
    for key in ("run", "skipped", "overruns", "lateness_us.p99", "step_us.max"):
        assert said[key] == dict(flat(printed))[key]
    assert {"tachobot: bus i2c1", "tachobot: imu"} <= statuses.keys()


def test_they_are_stale_without_a_run(robot: RosProcesses, user: RosUser) -> None:
    robot.node()
    received = Listener(user)
    (status,) = received.next().values()
    assert (status.name, status.level) == ("tachobot: run", STALE)
    run = started(robot)
    wait_until(lambda: received.next()["tachobot: run"].level != STALE, "the run is seen")
    run.kill()
    wait_until(lambda: received.next()["tachobot: run"].level == STALE, "the run is gone")
    assert "died" in received.next()["tachobot: run"].message
