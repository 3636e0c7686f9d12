"""What other processes ask of a run, and a loop that has no time left."""

from collections.abc import Iterator
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.settings import ExecutiveSettings
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import Clock, MonotonicClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.links.control import TIMEOUT_S, Answer
from firmware_runtime.runs import supervision
from firmware_runtime.runs.arming import Arming, Permission
from firmware_runtime.runs.requests import LONGEST_S, SHORTEST_S, SLOW, Leases, Requests
from firmware_runtime.runs.safe_state import SafeState
from firmware_runtime.runs.supervision import WINDOW, Overload, Policy, watch_load
from firmware_runtime.runs.tuning import Tuning
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import EPOCH, STEP_TIME
from firmware_runtime.statistics.summary import summary
from tests.support.periodic_models import Robot
from tests.support.ports_rig import Speaker


class Asked:
    """The requests of a run whose loop passes when the test says so."""

    def __init__(self, path: Path, *, is_free: bool = False) -> None:
        executive = Executive(Robot(), VirtualClock(), list, Configuration(armed_at_start=False))
        self.executive = executive
        self.arming = Arming(executive, Permission(at_start=False, demand_guard=False), list)
        tuning = Tuning(registry.load("tachobot"), lambda _: None)
        self.requests = Requests(
            path,
            executive,
            None,
            arming=None if is_free else self.arming,
            tuning=tuning,
            log=lambda _: None,
        )
        self._socket = self.requests._socket
        self.client = Speaker(path)
        self._socket.receive()
        self.client.received()

    def ask(self, *requests: dict[str, object]) -> None:
        """Let the loop read these."""
        for each in requests:
            self.client.say(each)
            self._socket.receive()

    def pass_by(self, left: int) -> None:
        """A pass of the loop, with so much time left until the next event."""
        self._socket.between_steps(0, left)

    def pass_by_too_late(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """The same with time enough, once nobody waits for an answer any more."""
        later = monotonic_ns() + round((TIMEOUT_S + 1) * SECOND)
        monkeypatch.setattr("firmware_runtime.runs.requests.monotonic_ns", lambda: later)
        self.pass_by(SECOND)

    def answers(self) -> list[Answer]:
        """What has been answered since the last call."""
        return self.client.received()


@pytest.fixture
def asked(tmp_path: Path) -> Iterator[Asked]:
    found = Asked(tmp_path / "x.socket")
    found.pass_by(0)
    yield found
    found.client.close()
    found.requests.close()


def test_arming_waits_for_time_enough_so_that_it_makes_no_step_late(asked: Asked) -> None:
    asked.ask({"request": "arm"})
    asked.pass_by(SLOW["arm"] - 1)
    assert not asked.arming.armed
    asked.pass_by(SLOW["arm"])
    assert asked.arming.armed
    assert asked.answers() == [{"refused": [], "armed": True}]


@pytest.mark.parametrize("sign", [1, -1], ids=["by the guard", "by safe-state"])
def test_a_request_to_arm_from_before_a_takeover_is_refused(asked: Asked, sign: int) -> None:
    """A run that stood still finds it when it goes on; who sent it was told of no answer."""
    asked.ask({"request": "arm"})
    asked.executive.cells[EPOCH] = sign * monotonic_ns()
    asked.arming.between_steps(0, 0)
    asked.pass_by(SECOND)
    assert not asked.arming.armed
    [answer] = asked.answers()
    assert "before the right to drive was taken" in answer["refused"][0]
    asked.ask({"request": "arm"})
    asked.pass_by(SECOND)
    assert asked.arming.armed


def test_a_request_to_arm_that_nothing_waits_for_any_more_is_refused(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked.ask({"request": "arm"})
    asked.pass_by_too_late(monkeypatch)
    assert not asked.arming.armed
    assert "expected one that is still waited for" in asked.answers()[0]["refused"][0]


def test_a_setting_that_nothing_waits_for_any_more_is_refused(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked.ask({"request": "set", "values": {"controller.yaw.kp": 0.7}})
    asked.pass_by_too_late(monkeypatch)
    asked.ask({"request": "get"})
    refused, found = asked.answers()
    assert "expected one that is still waited for" in refused["refused"][0]
    assert found["revision"] == 0
    assert found["values"]["controller.yaw.kp"] != 0.7


@pytest.mark.parametrize("within_s", [1.0, "soon"])
def test_a_request_that_says_for_how_long_it_is_waited_for_has_no_effect_later(
    asked: Asked, monkeypatch: pytest.MonkeyPatch, within_s: object
) -> None:
    later = monotonic_ns() + 2 * SECOND
    asked.ask({"request": "arm", "lease_s": 0.4, "within_s": within_s})
    monkeypatch.setattr("firmware_runtime.links.control.monotonic_ns", lambda: later)
    asked.pass_by(SECOND)
    assert not asked.arming.armed
    assert "expected" in asked.answers()[0]["refused"][0]


def test_a_request_that_is_still_waited_for_is_done(asked: Asked) -> None:
    asked.ask({"request": "arm", "lease_s": 0.4, "within_s": 60})
    asked.pass_by(SECOND)
    assert asked.arming.armed


def test_a_renewal_that_a_run_finds_late_is_no_sign_of_life(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked.ask({"request": "arm", "lease_s": 0.4})
    asked.pass_by(SECOND)
    [answer] = asked.answers()
    renewal = {"request": "renew", "lease": answer["lease"]}
    [leases] = [each for each in asked.executive.hooks if isinstance(each, Leases)]
    monkeypatch.setattr(leases, "_now", lambda: monotonic_ns() + 5 * SECOND)
    asked.ask(renewal)
    leases.between_steps(0, 0)
    assert not asked.arming.armed


def test_disarming_waits_for_nothing_and_no_request_before_it_arms(asked: Asked) -> None:
    asked.ask({"request": "arm"})
    asked.pass_by(SECOND)
    asked.ask({"request": "arm"}, {"request": "disarm"})
    assert not asked.arming.armed
    asked.pass_by(SECOND)
    assert not asked.arming.armed
    _, refused, disarmed = asked.answers()
    assert "disarmed" in refused["refused"][0]
    assert disarmed == {"not_safe": [], "armed": False}


def test_what_is_asked_after_disarming_arms_again(asked: Asked) -> None:
    asked.ask({"request": "arm"}, {"request": "disarm"}, {"request": "arm"})
    asked.pass_by(SECOND)
    assert asked.arming.armed


def test_it_says_whether_it_is_armed_and_why_not(asked: Asked) -> None:
    def state() -> tuple[object, object]:
        asked.ask({"request": "state"})
        [answer] = asked.answers()
        return answer["armed"], answer["reason"]

    assert state() == (False, "not requested yet")
    asked.arming.request(0)
    assert state() == (True, None)
    asked.ask({"request": "disarm"})
    asked.answers()
    assert state() == (False, "requested")


@pytest.mark.parametrize("request_", ["arm", "disarm", "renew", "state", "get", "set"])
def test_a_key_that_has_no_effect_is_refused_and_nothing_is_done(
    asked: Asked, request_: str
) -> None:
    values = {"values": {"controller.yaw.kp": 0.7}} if request_ == "set" else {}
    if request_ == "disarm":
        asked.arming.request(0)
    asked.ask({"request": request_, "leese_s": 0.4, **values})
    asked.pass_by(SECOND)
    [answer] = asked.answers()
    assert "leese_s: unknown key" in str(answer["refused"])
    assert asked.arming.armed is (request_ == "disarm")
    asked.ask({"request": "state"})
    assert asked.answers()[0]["revision"] == 0


@pytest.mark.parametrize("lease_s", [0.04, 61, "soon"])
def test_a_lease_that_cannot_be_arms_nothing(asked: Asked, lease_s: object) -> None:
    asked.ask({"request": "arm", "lease_s": lease_s})
    asked.pass_by(SECOND)
    assert "lease_s" in str(asked.answers()[0]["refused"])
    assert not asked.arming.was_armed


@pytest.mark.parametrize("lease_s", [SHORTEST_S, LONGEST_S])
def test_who_renews_a_lease_learns_whether_it_has_one(asked: Asked, lease_s: float) -> None:
    asked.ask({"request": "arm", "lease_s": lease_s})
    asked.pass_by(SECOND)
    lease = asked.answers()[0]["lease"]
    asked.ask({"request": "renew", "lease": lease}, {"request": "renew", "lease": "another"})
    assert [each["leased"] for each in asked.answers()] == [True, False]


@pytest.mark.parametrize("values", [{}, ["controller.yaw.kp"], None])
def test_a_setting_without_values_is_refused(asked: Asked, values: object) -> None:
    asked.ask({"request": "set", "values": values})
    asked.pass_by(SECOND)
    assert "values: expected an object" in str(asked.answers()[0]["refused"])


def test_a_run_that_may_always_drive_is_armed_and_cannot_be_disarmed(tmp_path: Path) -> None:
    free = Asked(tmp_path / "x.socket", is_free=True)
    free.pass_by(0)
    free.ask({"request": "arm", "lease_s": 1.0}, {"request": "renew", "lease": "any"})
    free.pass_by(SECOND)
    free.ask({"request": "disarm"}, {"request": "state"})
    answers = free.answers()
    assert [each["armed"] for each in answers] == [True] * 4
    assert [each["leased"] for each in answers if "leased" in each] == [True]
    free.client.close()
    free.requests.close()


def test_a_run_whose_right_cannot_be_taken_disarms_on_request_of_safe_state(
    asked: Asked, tmp_path: Path
) -> None:
    (tmp_path / "x.stats").write_bytes(b"of another version")
    asked.arming.request(0)
    SafeState([], None, tmp_path / "x.stats").take_right()
    asked._socket.receive()  # who asks
    asked._socket.receive()
    assert not asked.arming.armed


class Time:
    """Real time and processor time, as a test moves them; the computer has just been started."""

    def __init__(self) -> None:
        self.real = SECOND
        self.processor = SECOND


@pytest.fixture
def time(monkeypatch: pytest.MonkeyPatch) -> Time:
    now = Time()
    monkeypatch.setattr(supervision, "monotonic_ns", lambda: now.real)
    monkeypatch.setattr(supervision, "process_time_ns", lambda: now.processor)
    return now


class Rig:
    """A run that never begins, and what its overload does to it."""

    def __init__(self, time: Time, policy: Policy = "yield") -> None:
        self.time = time
        self.reported: list[str] = []
        self.executive = Executive(Robot(), MonotonicClock(), list, Configuration())
        permission = Permission(at_start=False, demand_guard=False)
        self.arming = Arming(self.executive, permission, list)
        self.watch = Overload(self.executive, 90.0, policy, self.arming, self.reported.append)
        self.watch.between_steps(0, 0)

    def pass_window(self, steps: float, processor: float = 0.0) -> None:
        """Let a window pass with these shares of it in steps, and in processor time."""
        self.time.real += WINDOW
        self.time.processor += round(processor * WINDOW)
        self.executive.cells[STEP_TIME] += round(steps * WINDOW)
        self.watch.between_steps(self.time.real - SECOND, 0)

    @property
    def run(self) -> dict[str, Any]:
        found: dict[str, Any] = self.executive.statistics.as_json()["conditions"]["run"]
        return found


@pytest.fixture
def fifo(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """As if SCHED_FIFO were held; what is given up is noted."""
    given_up: list[str] = []
    module = "firmware_runtime.executive.process"
    monkeypatch.setattr(f"{module}.holds_priority", lambda: not given_up)
    monkeypatch.setattr(f"{module}.give_up_priority", lambda: given_up.append("SCHED_FIFO"))
    return given_up  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("clock", "max_load_percent", "is_watched"),
    [
        (MonotonicClock(), 90.0, True),
        (MonotonicClock(), 100.0, False),
        (VirtualClock(), 90.0, False),
    ],
)
def test_the_load_is_watched_in_real_time_where_it_has_a_limit(
    clock: Clock, *, max_load_percent: float, is_watched: bool
) -> None:
    executive = Executive(Robot(), clock, list, Configuration())
    watch_load(executive, ExecutiveSettings(max_load_percent=max_load_percent), None, print)
    assert any(isinstance(each, Overload) for each in executive.hooks) is is_watched


def test_a_load_below_the_limit_is_not_logged(time: Time) -> None:
    rig = Rig(time)
    for _ in range(5):
        rig.pass_window(steps=0.89, processor=0.89)
    assert rig.reported == []
    assert rig.run["overloaded_s"] is None


@pytest.mark.parametrize(("steps", "processor"), [(0.95, 0.1), (0.1, 0.95)])
def test_steps_without_a_pause_and_processor_time_are_a_load_each(
    time: Time, steps: float, processor: float
) -> None:
    rig = Rig(time)
    rig.pass_window(steps, processor)
    assert "95 % of the last 3 s" in rig.reported[0]
    assert "max_load_percent = 90" in rig.reported[0]


def test_it_is_judged_over_whole_windows_and_logged_once(time: Time) -> None:
    rig = Rig(time)
    rig.executive.cells[STEP_TIME] += 2 * SECOND
    time.real += WINDOW - MILLISECOND
    rig.watch.between_steps(0, 0)
    assert rig.reported == []
    for _ in range(3):
        rig.pass_window(steps=1.0)
    assert len(rig.reported) == 1


def test_a_process_that_was_stopped_in_the_middle_of_a_step_is_not_overloaded(time: Time) -> None:
    rig = Rig(time)
    time.real += 100 * WINDOW
    rig.pass_window(steps=101.0)
    assert rig.reported == []
    rig.pass_window(steps=1.0)
    assert len(rig.reported) == 1


def test_priority_is_given_up_and_an_armed_run_disarmed(time: Time, fifo: list[str]) -> None:
    rig = Rig(time)
    rig.arming.request(0)
    rig.pass_window(steps=1.0)
    assert fifo == ["SCHED_FIFO"]
    assert not rig.arming.armed
    assert rig.arming.reason.startswith("overload: 100 %")
    assert "gives up SCHED_FIFO" in rig.reported[0]
    assert rig.run["overloaded_s"] > 0
    assert summary(rig.executive.statistics.figures()).endswith(" overloaded disarmed")


def test_without_priority_to_give_up_the_run_stays_armed_and_says_so(time: Time) -> None:
    rig = Rig(time)
    rig.arming.request(0)
    rig.pass_window(steps=1.0)
    assert rig.arming.armed
    assert "has no SCHED_FIFO to give up" in rig.reported[0]


def test_a_run_may_end_instead_which_is_no_requested_stop(time: Time, fifo: list[str]) -> None:
    rig = Rig(time, "stop")
    rig.pass_window(steps=1.0)
    outcome: Outcome = rig.executive.run(SECOND)
    assert outcome.state is RunState.OVERRUN
    assert outcome.reason.startswith("overload: 100 %")
    assert fifo == []
