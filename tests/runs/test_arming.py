"""When outputs may be driven, and when no longer."""

from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from time import monotonic_ns

import pytest
from msgspec.structs import replace

from firmware_runtime.board import registry
from firmware_runtime.board.ends import end_of
from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import OFF_AGAIN_EVERY
from firmware_runtime.hal.wire_errors import BusFault, HalError
from firmware_runtime.runs import arming
from firmware_runtime.runs.arming import GUARD_TIMEOUT, Arming, Permission, permission_for
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.layout import ACKNOWLEDGED, ARMED, EPOCH, GUARD
from tests.support.periodic_models import Robot

BEGUN_AT = 1000


class Rig:
    """An arming around a run; `safe` counts how often outputs were made safe."""

    def __init__(
        self,
        *,
        at_start: bool = False,
        demand_guard: bool = False,
        free: bool = False,
        safe_state_at: int = 0,
    ) -> None:
        self.safe = 0
        self.not_safe: list[str] = []
        self.logged: list[str] = []
        self.against: str | None = None
        configuration = Configuration(armed_at_start=False)
        self.executive = Executive(Robot(), VirtualClock(), list, configuration)
        self.enabled = 0
        self.failing: HalError | None = None
        self.during_checks: Callable[[], None] = lambda: None
        self.while_switching_off: Callable[[], None] = lambda: None
        self.arming = Arming(
            self.executive,
            Permission(at_start, demand_guard, free, BEGUN_AT),
            self._make_safe,
            [self._check],
            last_safe_state=lambda: safe_state_at,
            enable=self._enable,
            log=self.logged.append,
        )

    def take_right(self, epoch: int) -> None:
        """Take the run's right to drive, as another process does."""
        self.executive.cells[EPOCH] = epoch

    def _check(self, _now: int) -> str | None:
        self.during_checks()
        return self.against

    def _enable(self) -> None:
        if self.failing is not None:
            raise self.failing
        self.enabled += 1

    def _make_safe(self) -> list[str]:
        self.safe += 1
        self.while_switching_off()
        return self.not_safe

    @property
    def cells(self) -> tuple[int, int]:
        return self.executive.cells[ARMED], self.executive.cells[ACKNOWLEDGED]


def test_it_is_disarmed_until_it_is_requested_and_says_nothing_until_then() -> None:
    rig = Rig()
    rig.arming.between_steps(0, 0)
    assert (rig.arming.interlock(), rig.logged) == (False, [])
    assert not rig.arming.was_armed
    assert rig.arming.request(0) == []
    assert rig.arming.was_armed
    assert rig.arming.interlock()
    assert rig.cells == (1, 0)


def test_a_failed_check_keeps_it_disarmed_and_is_given_as_the_reason() -> None:
    rig = Rig()
    rig.against = "imu is not up yet"
    assert rig.arming.request(0) == ["imu is not up yet"]
    assert not rig.arming.interlock()
    assert rig.arming.reason == "imu is not up yet"


def test_outputs_are_let_through_before_it_is_armed_and_not_armed_if_they_cannot_be() -> None:
    rig = Rig()
    rig.failing = BusFault("output_enable: line 17 cannot be set")
    assert rig.arming.request(0) == ["output_enable: line 17 cannot be set"]
    assert (rig.arming.interlock(), rig.arming.reason) == (False, str(rig.failing))
    assert rig.safe == 1
    rig.failing = None
    assert rig.arming.request(0) == []
    assert rig.arming.request(0) == []
    assert rig.enabled == 1


def test_a_board_that_asks_for_it_is_armed_as_soon_as_all_checks_pass() -> None:
    rig = Rig(at_start=True)
    rig.against = "not yet"
    rig.arming.between_steps(0, 0)
    assert not rig.arming.armed
    rig.against = None
    rig.arming.between_steps(50 * MILLISECOND, 0)
    assert not rig.arming.armed
    rig.arming.between_steps(100 * MILLISECOND, 0)
    assert rig.arming.armed


def test_what_stands_in_the_way_is_said_at_once_and_when_it_changes_and_not_repeated() -> None:
    rig = Rig(at_start=True)
    turning = "imu is not calibrated yet (the robot moved: {} rad/s)"
    in_the_way = [turning.format(0.31), turning.format(0.29), turning.format(-1.2), "no link", None]
    for number, against in enumerate(in_the_way):
        rig.against = against
        for now in range(number * SECOND, (number + 1) * SECOND, 100 * MILLISECOND):
            rig.arming.between_steps(now, 0)
    assert rig.logged == [
        "not armed yet: imu is not calibrated yet (the robot moved: 0.31 rad/s)",
        "not armed yet: no link",
        "armed",
    ]


def test_what_a_run_was_disarmed_for_is_not_said_twice() -> None:
    rig = Rig(at_start=True)
    rig.arming.between_steps(0, 0)
    rig.against = "the controller has been silent for 0.6 s"
    rig.arming.suspend("the controller has been silent for 0.5 s")
    rig.arming.between_steps(0, 0)
    assert rig.logged == ["armed", "disarmed: the controller has been silent for 0.5 s"]
    rig.against = "imu has failed"
    rig.arming.between_steps(SECOND, 0)
    assert rig.logged[-1] == "not armed yet: imu has failed"


@pytest.mark.parametrize("free", [False, True])
def test_a_safe_state_that_came_while_it_started_keeps_it_disarmed_until_it_is_requested(
    *, free: bool
) -> None:
    rig = Rig(at_start=True, free=free, safe_state_at=BEGUN_AT + 1)
    for now in range(0, SECOND, 100 * MILLISECOND):
        rig.arming.between_steps(now, 0)
    assert (rig.arming.armed, rig.safe) == (False, 1)
    assert rig.cells == (0, -BEGUN_AT - 1)
    assert rig.logged == ["stays disarmed: safe-state took its right to drive"]
    assert rig.arming.epoch == -BEGUN_AT - 1
    assert rig.arming.request(SECOND) == []
    rig.arming.between_steps(SECOND, 0)
    assert rig.arming.armed


def test_of_two_safe_states_the_later_one_counts_for_requests() -> None:
    rig = Rig(at_start=True, safe_state_at=BEGUN_AT + 1)
    rig.executive.cells[EPOCH] = -BEGUN_AT - 3
    rig.arming.between_steps(0, 0)
    assert rig.arming.epoch == -BEGUN_AT - 3
    assert not rig.arming.armed


def test_a_safe_state_after_the_guard_was_first_is_why_it_is_off() -> None:
    rig = Rig(at_start=True)
    rig.arming.between_steps(0, 0)
    rig.take_right(3)
    rig.arming.between_steps(1, 0)
    rig.take_right(-4)
    for now in (2, 3):
        rig.arming.between_steps(now, 0)
    why = "safe-state took its right to drive"
    assert rig.logged[-2:] == [
        "disarmed: the guard took over, because this process seemed dead",
        f"stays disarmed: {why}",
    ]
    assert (rig.arming.reason, rig.cells) == (why, (0, -4))


def test_a_safe_state_from_before_it_was_called_for_is_over() -> None:
    rig = Rig(at_start=True, safe_state_at=BEGUN_AT)
    rig.arming.between_steps(0, 0)
    assert rig.arming.armed


@pytest.mark.parametrize(
    ("epoch", "said"), [(3, "the guard took over"), (-3, "safe-state took its right to drive")]
)
def test_a_takeover_disarms_at_once_and_is_acknowledged_once_outputs_are_safe(
    epoch: int, said: str
) -> None:
    rig = Rig()
    rig.arming.request(0)
    rig.executive.cells[EPOCH] = epoch
    assert not rig.arming.interlock()
    assert rig.cells == (1, 0)
    rig.arming.between_steps(0, 0)
    assert (rig.safe, rig.cells) == (1, (0, epoch))
    assert said in rig.logged[-1]
    rig.executive.cells[EPOCH] = 2 * epoch  # also while it is disarmed
    rig.arming.between_steps(0, 0)
    assert (rig.safe, rig.cells) == (2, (0, 2 * epoch))
    assert rig.arming.request(0) == []
    assert rig.arming.interlock()


def test_a_request_that_comes_before_a_takeover_was_noticed_does_not_say_armed() -> None:
    rig = Rig()
    rig.arming.request(0)
    rig.executive.cells[EPOCH] += 1
    rig.against = "an overrun in the last 5 s"
    assert rig.arming.request(1) == ["an overrun in the last 5 s"]
    assert not rig.arming.armed
    assert rig.safe == 1
    rig.against = None
    assert rig.arming.request(2) == []
    assert rig.arming.interlock()


def test_what_a_person_switched_off_does_not_arm_itself_as_its_board_may_want() -> None:
    rig = Rig(at_start=True)
    rig.against = "not yet"
    rig.arming.between_steps(0, 0)
    rig.executive.cells[EPOCH] = -3
    rig.arming.between_steps(0, 0)
    rig.against = None
    rig.arming.between_steps(SECOND, 0)
    assert not rig.arming.armed
    assert (rig.safe, rig.cells) == (1, (0, -3))
    assert rig.arming.request(SECOND) == []
    assert rig.arming.interlock()


def test_what_is_taken_while_the_checks_are_made_is_not_armed() -> None:
    """Its epoch was not there when it was judged: `safe-state` came before the arming."""
    rig = Rig(at_start=True)
    rig.during_checks = partial(rig.take_right, -3)
    rig.arming.between_steps(0, 0)
    assert not rig.arming.interlock()
    for now in (0, SECOND, 2 * SECOND):
        rig.arming.between_steps(now, 0)
    assert (rig.arming.interlock(), rig.cells) == (False, (0, -3))
    rig.during_checks = partial(rig.take_right, -4)
    assert rig.arming.request(2 * SECOND) == []
    assert not rig.arming.interlock()


@pytest.mark.parametrize("ends", ["takeover", "pause", "suspend"])
def test_what_is_taken_while_outputs_are_switched_off_does_not_arm_itself(ends: str) -> None:
    rig = Rig(at_start=True)
    if ends == "takeover":  # the guard's, before it was ever armed: it stays wanted
        rig.against = "not yet"
        rig.arming.between_steps(0, 0)
        rig.executive.cells[EPOCH] = 3
    else:
        rig.arming.between_steps(0, 0)
    rig.while_switching_off = partial(rig.take_right, -5)
    match ends:
        case "takeover":
            rig.arming.between_steps(0, 0)
        case "pause":
            rig.arming.pause()
        case _:
            rig.arming.suspend("silent")
    rig.against = None
    for now in (0, SECOND, 2 * SECOND):
        rig.arming.between_steps(now, 0)
    assert (rig.arming.interlock(), rig.cells) == (False, (0, -5))


def test_a_free_run_is_armed_and_pauses_without_a_word_and_loses_its_right_all_the_same() -> None:
    rig = Rig(at_start=True, free=True)
    rig.against = "an overrun"
    rig.arming.between_steps(0, 0)
    assert rig.arming.interlock()
    rig.arming.pause()
    rig.arming.between_steps(SECOND, 0)
    assert (rig.safe, rig.logged, rig.arming.interlock()) == (1, [], True)
    rig.executive.cells[EPOCH] = -3
    assert not rig.arming.interlock()


def test_a_board_that_was_disarmed_does_not_arm_itself_again() -> None:
    rig = Rig(at_start=True)
    rig.arming.between_steps(0, 0)
    rig.arming.disarm("asked for")
    rig.arming.between_steps(SECOND, 0)
    assert not rig.arming.armed


def test_outputs_that_could_not_be_switched_off_are_switched_off_again_until_they_are() -> None:
    rig = Rig()
    rig.arming.request(0)
    rig.not_safe = ["i2c1 0x40: timed out"]
    assert rig.arming.disarm("asked for") == rig.not_safe
    rig.arming.between_steps(OFF_AGAIN_EVERY - 1, 0)
    assert rig.safe == 1
    rig.arming.between_steps(OFF_AGAIN_EVERY, 0)
    rig.not_safe = []
    rig.arming.between_steps(OFF_AGAIN_EVERY, 0)
    rig.arming.between_steps(SECOND, 0)
    assert rig.safe == 3


def test_a_guard_that_is_demanded_must_show_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, now = Rig(demand_guard=True), 100 * SECOND
    monkeypatch.setattr(arming, "monotonic_ns", lambda: now)
    assert "the guard is absent" in rig.arming.request(0)[0]
    rig.executive.cells[GUARD] = now - GUARD_TIMEOUT
    assert rig.arming.request(0) == []
    assert rig.arming.interlock()
    rig.executive.cells[GUARD] -= 1
    assert not rig.arming.interlock()
    rig.arming.between_steps(0, 0)
    assert rig.logged[-1] == "disarmed: the guard is gone"
    assert "the guard is absent" in rig.arming.request(0)[0]


def test_a_pause_switches_off_and_arms_again_by_the_same_terms() -> None:
    rig = Rig(at_start=True)
    rig.arming.between_steps(0, 0)
    assert rig.arming.pause() == []
    assert (rig.arming.interlock(), rig.safe, rig.cells) == (False, 1, (0, 0))
    rig.against = "imu is not up yet"
    rig.arming.between_steps(0, 0)
    assert not rig.arming.interlock()
    rig.against = None
    rig.arming.between_steps(SECOND, 0)
    assert rig.arming.interlock()
    waits = "not armed yet: imu is not up yet"
    assert rig.logged == ["armed", "disarmed: the run pauses", waits, "armed"]


def test_a_pause_of_what_was_not_armed_switches_off_and_changes_nothing() -> None:
    rig = Rig()
    assert rig.arming.pause() == []
    rig.arming.between_steps(SECOND, 0)
    assert (rig.arming.interlock(), rig.safe, rig.logged) == (False, 1, [])
    assert rig.arming.reason == "not requested yet"


@pytest.mark.parametrize("ends", ["pause", "suspend"])
def test_a_takeover_that_a_pause_or_a_silence_finds_is_one(ends: str) -> None:
    rig = Rig()
    rig.arming.request(0)
    rig.executive.cells[EPOCH] = -7
    if ends == "pause":
        rig.arming.pause()
    else:
        rig.arming.suspend("silent")
    rig.arming.between_steps(SECOND, 0)
    assert not rig.arming.interlock()
    assert rig.arming.reason == "safe-state took its right to drive"


def test_what_was_suspended_and_armed_on_request_is_suspended_no_more() -> None:
    rig = Rig(at_start=True)
    rig.arming.between_steps(0, 0)
    rig.against = "silent"
    rig.arming.suspend("silent")
    rig.against = None
    assert rig.arming.request(0) == []
    rig.arming.pause()
    rig.executive.cells[EPOCH] = 7  # the guard takes over what pauses for long
    for now in (0, SECOND):
        rig.arming.between_steps(now, 0)
    assert rig.arming.interlock()


def test_what_goes_on_after_a_pause_is_armed_at_once() -> None:
    rig = Rig(at_start=True)
    rig.arming.between_steps(0, 0)
    rig.arming.pause()
    rig.arming.between_steps(0, 0)
    assert rig.arming.interlock()


SERVED = Path("doubles.socket")
BOARD, AT_START = registry.load("detective"), registry.load("detective", ["arming.at_start=true"])
OF_BOARD = Permission(BOARD.settings.arming.at_start, BOARD.settings.arming.demand_guard)
FREE_TO_DRIVE = Permission(at_start=True, demand_guard=False, free=True)
AS_CHIPS = {"supervised": True, "arm": False}
TO_ARM = {"supervised": False, "arm": True}
AS_IT_IS = {"supervised": False, "arm": False}


@pytest.mark.parametrize(
    ("board", "doubles", "role", "words", "expected"),
    [
        (BOARD, False, None, AS_IT_IS, OF_BOARD),
        (BOARD, False, None, TO_ARM, replace(OF_BOARD, at_start=True)),
        (AT_START, False, None, AS_IT_IS, replace(OF_BOARD, at_start=True)),
        (BOARD, True, None, AS_CHIPS, OF_BOARD),
        (BOARD, SERVED, None, AS_CHIPS, OF_BOARD),
        (BOARD, True, None, AS_IT_IS, None),
        (BOARD, SERVED, None, AS_IT_IS, FREE_TO_DRIVE),
        (BOARD, True, "robot", AS_IT_IS, FREE_TO_DRIVE),
        (BOARD, False, "robot", AS_IT_IS, OF_BOARD),
        (BOARD, False, "controller", AS_IT_IS, None),
    ],
)
def test_outputs_are_driven_on_the_terms_of_their_board_unless_they_are_doubles(
    board: Board,
    *,
    doubles: bool | Path,
    role: str | None,
    words: dict[str, bool],
    expected: Permission | None,
) -> None:
    end = None if role is None else end_of(board, role)
    found = permission_for(board, doubles=doubles, end=end, begun_at=BEGUN_AT, **words)
    assert found == (expected and replace(expected, begun_at=BEGUN_AT))


def test_a_run_is_called_for_now_if_nothing_else_is_stated() -> None:
    before = monotonic_ns()
    permission = permission_for(BOARD, doubles=False, arm=False, supervised=False)
    assert permission is not None
    assert permission.begun_at is not None
    assert before <= permission.begun_at <= monotonic_ns()


@pytest.mark.parametrize(("epoch", "is_armed"), [(7, True), (-7, False)])
def test_what_the_guard_takes_in_a_pause_is_armed_again_and_what_a_person_takes_is_not(
    epoch: int, *, is_armed: bool
) -> None:
    """The guard takes every run over that pauses for longer than a hang is waited for."""
    rig = Rig(at_start=True)
    rig.arming.between_steps(0, 0)
    rig.arming.pause()
    rig.executive.cells[EPOCH] = epoch
    for now in (0, SECOND):
        rig.arming.between_steps(now, 0)
    assert rig.arming.interlock() is is_armed


@pytest.mark.parametrize(("epoch", "by"), [(7, "the guard"), (-7, "safe-state")])
def test_what_is_taken_while_a_link_is_bad_is_not_armed_again(epoch: int, by: str) -> None:
    rig = Rig(at_start=True)
    rig.arming.between_steps(0, 0)
    rig.against = "the controller has been silent for 0.5 s"
    rig.arming.suspend(rig.against)
    rig.executive.cells[EPOCH] = epoch
    rig.arming.between_steps(0, 0)
    rig.against = None
    rig.arming.between_steps(SECOND, 0)
    assert not rig.arming.interlock()
    assert by in rig.arming.reason
    assert rig.logged[-1] == f"stays disarmed: {rig.arming.reason}"
    assert rig.arming.request(SECOND) == []
    rig.arming.suspend("silent again")
    rig.arming.between_steps(2 * SECOND, 0)
    assert rig.arming.interlock()


@pytest.mark.parametrize(
    ("permission", "is_driven"),
    [(None, True), (Permission(at_start=False, demand_guard=False), False)],
    ids=["free", "on request"],
)
def test_inputs_that_may_fall_silent_let_no_run_drive_that_is_to_be_armed_on_request(
    permission: Permission | None, *, is_driven: bool
) -> None:
    board = replace(registry.load("tachobot"), inputs={})
    session = start_session(
        board, VirtualClock(), doubles=True, statistics_path=None, permission=permission
    )
    with closing(session):
        session.run(20 * MILLISECOND)
        assert session.arming is not None
        assert (session.arming.is_free, session.arming.was_armed) == (is_driven, is_driven)
