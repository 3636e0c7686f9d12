"""What a run was granted, and what it gave up."""

from typing import Any

from msgspec.structs import asdict

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.file_header import Conditions, RunFigures, conditions_of
from firmware_runtime.statistics.summary import refusals

RUN = RunFigures(
    state="running",
    reason=None,
    complete=True,
    elapsed_s=5.0,
    steps=1,
    inputs_dropped=0,
    overloaded_s=None,
    armed=False,
    guarded=False,
    cpu_s=None,
)
FIFO = {"asked": 60, "granted": True, "reason": None}
GRANTED = {
    "scheduler": "SCHED_FIFO",
    "scheduler_priority": 60,
    "settings": {"fifo_priority": FIFO},
}


def held(stated: dict[str, Any], yielded_ns: int = 0) -> Conditions:
    return conditions_of(stated, RUN, yielded_ns)


def test_what_holds_is_stated_as_it_is() -> None:
    now = held(GRANTED)
    run = asdict(RUN)
    assert run.pop("began_ns") is None
    assert now.as_json() == {**GRANTED, "run": run}
    assert list(refusals(now.settings)) == []
    assert now.refused == {}


def test_priority_that_was_given_up_is_not_granted_any_more() -> None:
    now = held(GRANTED, 3 * SECOND)
    assert list(refusals(now.settings)) == [
        "not granted: fifo_priority = 60 (given up after 3.0 s: overload)"
    ]
    assert (now.text("scheduler"), now.stated["scheduler_priority"]) == ("SCHED_OTHER", 0)
    assert FIFO["granted"]


def test_a_run_without_priority_has_none_to_give_up() -> None:
    settings = {"fifo_priority": {"asked": 60, "granted": False, "reason": "EPERM"}}
    assert held({"settings": settings}, SECOND) == held({"settings": settings})
    assert held({}, SECOND) == held({})


def test_what_was_not_requested_is_not_refused() -> None:
    settings = {"spin_us": {"asked": 0.0, "granted": False, "reason": "not asked for"}}
    assert held({"settings": settings}).refused == {}


def test_what_is_not_known_has_no_text() -> None:
    now = held({"governor": None, "cpu_count": 4})
    assert (now.text("governor"), now.text("kernel"), now.text("cpu_count")) == (None, None, "4")
