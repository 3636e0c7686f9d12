"""What a run was granted, and what it gave up."""

from typing import Any

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.refusals import as_they_hold, refusals

GRANTED: dict[str, Any] = {
    "scheduler": "SCHED_FIFO",
    "scheduler_priority": 60,
    "settings": {"fifo_priority": {"asked": 60, "granted": True, "reason": None}},
}


def test_what_holds_is_told_as_it_is() -> None:
    assert as_they_hold(GRANTED, 0) == GRANTED
    assert refusals(GRANTED) == []


def test_priority_that_was_given_up_is_not_granted_any_more() -> None:
    now = as_they_hold(GRANTED, 3 * SECOND)
    assert refusals(now) == ["not granted: fifo_priority = 60 (given up after 3.0 s: overload)"]
    assert (now["scheduler"], now["scheduler_priority"]) == ("SCHED_OTHER", 0)
    assert GRANTED["settings"]["fifo_priority"]["granted"]


def test_a_run_without_priority_has_none_to_give_up() -> None:
    refused = {"settings": {"fifo_priority": {"asked": 60, "granted": False, "reason": "EPERM"}}}
    assert as_they_hold(refused, SECOND) == refused
    assert as_they_hold({}, SECOND) == {}
