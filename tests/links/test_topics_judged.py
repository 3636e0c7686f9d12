"""What a node's diagnostics say of its topics."""

from firmware_runtime.devs.time import SECOND
from firmware_runtime.links.ros2.judgement import Level, TopicJudge


def test_before_the_first_message_nothing_is_said() -> None:
    assert TopicJudge("rover").judge({}, 0) == []


def test_counts_are_shown_and_what_was_refused_is_a_warning_for_ten_seconds() -> None:
    judge = TopicJudge("rover")
    (status,) = judge.judge({"published": 3, "inactive": 2, "refused": 1}, 0)
    assert (status.name, status.level) == ("rover: topics", Level.OK)  # of a time before
    assert status.values == {"published": "3", "inactive": "2", "refused": "1"}
    (status,) = judge.judge({"published": 9, "refused": 3}, SECOND)
    assert status.level == Level.WARN
    assert status.message == "in the last 10 s: 2 refused"
    (status,) = judge.judge({"published": 9, "refused": 3}, 12 * SECOND)
    assert status.level == Level.OK
