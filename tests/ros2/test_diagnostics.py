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


def test_they_are_stale_without_a_run_and_else_the_numbers_of_stats(
    robot: RosProcesses, user: RosUser
) -> None:
    robot.node()
    received = Listener(user)
    (status,) = received.next().values()
    assert (status.name, status.level) == ("tachobot: run", STALE)
    run = started(robot)
    wait_until(lambda: received.next()["tachobot: run"].level != STALE, "the run is seen")
    assert received.next()["tachobot: run"].hardware_id == "tachobot"
    run.kill()  # from then on they stay as they are
    run.wait()
    wait_until(lambda: received.next()["tachobot: run"].level == STALE, "the run is gone")
    statuses, printed = received.next(), stats(robot)
    assert "died" in statuses["tachobot: run"].message
    for path, model in printed["models"].items():
        said = {each.key: each.value for each in statuses[f"tachobot: {path}"].values}
        assert said == dict(flat({**model, "faults": printed["faults"].get(path, {})}))
    for name, bus in printed["bus"].items():
        said = {each.key: each.value for each in statuses[f"tachobot: bus {name}"].values}
        assert said == dict(flat(bus))
    said = {each.key: each.value for each in statuses["tachobot: run"].values}
    for key in ("scheduled", "run", "skipped", "overruns", "lateness_us.p99", "step_us.max"):
        assert said[key] == dict(flat(printed))[key]


def test_a_run_that_stands_still_is_an_error(robot: RosProcesses, user: RosUser) -> None:
    run = started(robot)
    robot.node()
    received = Listener(user)
    run.send_signal(signal.SIGSTOP)
    wait_until(
        lambda: "stands still" in received.next()["tachobot: run"].message, "it stands still"
    )
    assert received.next()["tachobot: run"].level == ERROR


def test_topics_of_a_node_that_is_configured_are_counted(
    robot: RosProcesses, user: RosUser
) -> None:
    started(robot)
    robot.node("--autostart")
    received = Listener(user)
    wait_until(lambda: "tachobot: topics" in received.next(), "topics are counted")
    said = {each.key: int(each.value) for each in received.next()["tachobot: topics"].values}
    assert said["published"] > 0
