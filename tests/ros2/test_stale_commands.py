"""Commands that a node must not hand on: its lease may be gone, their time is wrong."""

from pathlib import Path
from time import monotonic_ns, time_ns

import pytest
from std_msgs.msg import Float64

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ControlError
from firmware_runtime.links.ros2.__main__ import topics_of_plan
from firmware_runtime.links.ros2.node import IN_DOUBT, STANDSTILL, Part, RobotNode
from firmware_runtime.links.ros2.topics import OLDEST, check_age
from tests.support.parrot_node import spinning
from tests.support.replies import Replies
from tests.support.ros_user import RosUser
from tests.support.waiting import wait_until

STATE = {"run": "a", "armed": False, "reason": None, "revision": 0, "refused": []}


def test_a_command_has_an_age_only_where_clocks_agree() -> None:
    check_age(time_ns())
    check_age(0)  # no time in it
    check_age(time_ns() + OLDEST // 2)
    with pytest.raises(ValueError, match=r"older than 0\.5 s"):
        check_age(time_ns() - OLDEST - SECOND)
    with pytest.raises(ValueError, match=r"more than 0\.5 s in the future"):
        check_age(time_ns() + OLDEST + SECOND)


class Failing(Part):
    """Follows a run that does not answer."""

    def __init__(self) -> None:
        self.followed = 0

    def follow(self, revision: int) -> None:  # noqa: ARG002 -- it is not answered
        """Be asked, and find no answer."""
        self.followed += 1
        raise ControlError("no answer within 1 s")


def _is_handed_on(run: Replies) -> bool:
    """Whether a command has come since it was last asked."""
    return any('"say"' in each for each in run.requests())


def test_a_node_that_may_have_lost_its_lease_hands_no_command_on(
    node: RobotNode, user: RosUser, tmp_path: Path
) -> None:
    commands = user.node.create_publisher(Float64, "/parrot/say", 10)
    with Replies(tmp_path / "parrot.stats") as run, spinning(node) as until:
        taken = topics_of_plan(node, node.plan)
        taken.configure()
        taken.activate()
        node.run.lease = "one that no run has confirmed"
        for kind, number in (("refused", 1.0), ("taken", 2.0)):

            def has_come(number: float = number) -> bool:
                if taken.counts["refused"] + taken.counts["taken"] >= number:
                    return True
                commands.publish(Float64(data=number))
                return False

            until(has_come)
            assert taken.counts[kind] == 1
            if kind == "taken":
                wait_until(lambda: _is_handed_on(run), "it is handed on")
            assert not _is_handed_on(run)
            node.run.lease = None
        taken.clean_up()


def test_a_node_that_has_stood_still_doubts_what_waited_meanwhile(
    node: RobotNode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A request to arm that somebody has given up must not arm, nor a command that is old move."""
    now = monotonic_ns()
    monkeypatch.setattr("firmware_runtime.links.ros2.node.monotonic_ns", lambda: now)
    with Replies(tmp_path / "parrot.stats") as run:
        run.answer_in_background(STATE)
        node.trigger_configure()
        run.wait()
        now += STANDSTILL + SECOND
        node.trigger_activate()
        assert node.phase == "inactive"
        assert "has just stood still" in node.refusal
        assert not any('"arm"' in each for each in run.requests())
        now += IN_DOUBT
        run.answer_in_background({"refused": [], "armed": True, "lease": "5f0c"})
        node.trigger_activate()
        assert node.phase == "active"
        now += STANDSTILL + SECOND
        assert node.run.lease is not None
        assert node.has_stood_still()
        node.run.lease = None


def test_a_run_that_does_not_answer_when_its_settings_change_ends_no_node(
    node: RobotNode, tmp_path: Path
) -> None:
    failing = Failing()
    with Replies(tmp_path / "parrot.stats") as run, spinning(node) as until:
        run.answer_in_background(STATE)
        node.trigger_configure()
        run.wait()
        assert node.phase == "inactive"
        node.parts.append(failing)

        def has_followed() -> bool:
            if run.has_request():
                run.answer(STATE)
            return failing.followed == 2

        until(has_followed)
    assert node.phase == "inactive"
    assert "no answer within 1 s" in node.refusal
