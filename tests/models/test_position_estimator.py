import math

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.position_estimator import AGREEING, TOO_MANY, UNSOUND
from firmware_runtime.models.position_filter import TOO_OLD
from firmware_runtime.models.position_fix import (
    FixReport,
    PlanarInertial,
    PoseFix,
    PositionFix,
    PositionState,
)
from tests.support.tracked_body import NOISE, TICK, Estimator

HERE = PositionFix(1.0, 2.0, 0.0)


def test_without_a_position_nothing_is_sent_and_it_is_not_ready() -> None:
    estimator = Estimator()
    for n in range(10):
        estimator.sample(n * TICK)
    assert estimator.x == []
    assert estimator.model.unready() == "has no position"


def test_of_positions_that_are_all_refused_it_says_how_many_and_why() -> None:
    estimator = Estimator()
    for n in range(150):
        estimator.sample(n * TICK)
        if n >= 148:
            estimator.put(n * TICK + 1, position=HERE._replace(age_s=1.4))
    estimator.sample(150 * TICK)
    said = f"has no position; 2 came and were refused, the last: {TOO_OLD}"
    assert estimator.model.unready() == said


def test_every_sample_is_answered_at_once_from_the_first_position_on() -> None:
    estimator = Estimator()
    for n in range(5):
        estimator.sample(n * TICK)
    estimator.put(4 * TICK + 1, position=HERE)
    assert estimator.x == []
    for n in range(5, 10):
        estimator.sample(n * TICK)
    assert [motion.position for motion in estimator.x] == pytest.approx([1.0] * 5)
    assert [motion.position for motion in estimator.y] == pytest.approx([2.0] * 5)
    assert estimator.model.unready() is None


def test_the_age_and_the_latency_say_when_a_position_was_measured() -> None:
    """A body that speeds up: where it was 0.1 s ago is not where it is."""
    estimator = Estimator(latency=60 * MILLISECOND)
    for n in range(200):
        at_s = n * TICK / SECOND
        past_s = at_s - 0.1
        estimator.sample(n * TICK, PlanarInertial(0.5, 0.0, 0.0, 0.0))
        if n > 20 and n % 5 == 0:
            x = 0.25 * past_s * abs(past_s)
            estimator.put(n * TICK, position=PositionFix(x, 0.0, 0.04))
    true = 0.25 * (199 * TICK / SECOND) ** 2
    assert estimator.x[-1].position == pytest.approx(true, abs=0.01)
    assert estimator.reports[-1].age_s == pytest.approx(0.11)


@pytest.mark.parametrize(
    "fix",
    [
        PositionFix(math.nan, 0.0, 0.0),
        PositionFix(0.0, math.inf, 0.0),
        PositionFix(0.0, 0.0, -0.1),
        PoseFix(0.0, 0.0, math.nan, 0.0),
    ],
)
def test_a_fix_that_cannot_be_is_refused(fix: PositionFix | PoseFix) -> None:
    estimator = Estimator()
    estimator.sample(0)
    port = "position" if isinstance(fix, PositionFix) else "pose"
    estimator.put(1, **{port: fix})
    estimator.sample(TICK)
    assert estimator.reports == [FixReport(False, UNSOUND, 0.0, 0.0, 0.0, 0.0)]
    assert (estimator.x, estimator.model.refused) == ([], 1)


def test_more_fixes_than_a_step_takes_are_refused() -> None:
    estimator = Estimator()
    estimator.sample(0)
    for n in range(5):
        estimator.put(1 + n, position=HERE)
    estimator.sample(TICK)
    assert [report.reason for report in estimator.reports].count(TOO_MANY) == 3
    assert (estimator.model.taken, estimator.model.refused) == (2, 3)


def test_a_position_alone_never_sends_the_motion_again() -> None:
    estimator = Estimator()
    for n in range(3):
        estimator.put(n * TICK, position=HERE)
        estimator.sample(n * TICK + 1)
    sent = len(estimator.x)
    assert sent > 0
    for n in range(5):  # the inertial unit is dead
        estimator.put((4 + n) * TICK, position=HERE)
    assert [report.reason for report in estimator.reports].count(TOO_MANY) == 3
    assert (len(estimator.x), len(estimator.yaw)) == (sent, sent)


@pytest.mark.slow
def test_the_history_does_not_grow_beyond_its_length() -> None:
    estimator = Estimator(history=30)
    for n in range(500):
        estimator.sample(n * TICK)
        estimator.put(n * TICK, position=HERE)
    spans = estimator.model.history._spans
    assert len(spans) == 30
    assert sum(len(span.fixes) for span in spans) <= 60


def test_a_position_given_up_is_given_up() -> None:
    estimator = Estimator()
    for n in range(5):
        estimator.sample(n * TICK)
        estimator.put(n * TICK, position=HERE)
    estimator.state(5 * TICK, PositionState.SAFE)
    sent = len(estimator.x)
    estimator.put(6 * TICK, position=HERE)
    estimator.sample(7 * TICK)
    assert len(estimator.x) == sent
    assert "lost the position" in (estimator.model.unready() or "")
    assert estimator.model.phase == "given up"


def test_while_it_is_lost_it_is_not_ready_and_any_position_is_taken() -> None:
    estimator = Estimator()
    for n in range(50):
        estimator.sample(n * TICK)
        if n < 20:
            estimator.put(n * TICK, position=HERE)
    far = PositionFix(30.0, 30.0, 0.0)
    estimator.put(50 * TICK, position=far)
    estimator.sample(51 * TICK)
    assert not estimator.reports[-1].is_taken
    estimator.state(52 * TICK, PositionState.LOST)
    assert "lost the position" in (estimator.model.unready() or "")
    estimator.put(53 * TICK, position=far)
    estimator.sample(54 * TICK)
    assert estimator.reports[-1].is_taken
    assert estimator.x[-1].position == pytest.approx(30.0)


def test_what_nobody_expected_leads_back_once_enough_agree_with_it_in_a_row() -> None:
    estimator = Estimator()
    believed: list[FixReport] = []
    estimator.simulator.listen(estimator.model.fix, lambda _at, report: believed.append(report))
    for n in range(20):
        estimator.sample(n * TICK)
        estimator.put(n * TICK, position=HERE)
    estimator.sample(20 * TICK)
    believed.clear()
    estimator.state(21 * TICK, PositionState.LOST)
    places = [30.0, *[30.0] * (AGREEING - 1), 60.0, *[60.0] * (AGREEING + 1)]
    sent = []
    for n, x_m in enumerate(places, start=22):
        estimator.put(n * TICK, position=PositionFix(x_m, 2.0, 0.0))
        estimator.sample(n * TICK + 1)
        sent.append(len(believed))
    assert sent == [0] * (len(places) - 2) + [1, 2]
    assert estimator.model.unexpected == 2


def test_after_a_silence_the_first_that_was_expected_leads_back() -> None:
    estimator = Estimator()
    believed: list[FixReport] = []
    estimator.simulator.listen(estimator.model.fix, lambda _at, report: believed.append(report))
    for n in range(100):
        estimator.sample(n * TICK)
        if n < 20:
            estimator.put(n * TICK, position=HERE)
    believed.clear()
    estimator.state(100 * TICK, PositionState.LOST)
    estimator.put(101 * TICK, position=HERE)
    estimator.sample(102 * TICK)
    assert len(believed) == 1


def test_a_measured_yaw_leads_from_the_attitudes_zero_to_the_rooms() -> None:
    estimator = Estimator()
    for n in range(50):
        estimator.sample(n * TICK, PlanarInertial(0.0, 0.0, 0.2, 0.0))
        estimator.put(n * TICK, pose=PoseFix(0.0, 0.0, 1.2, 0.0))
    assert estimator.yaw[-1].position == pytest.approx(1.2, abs=1e-6)


def test_a_yaw_counts_at_the_instant_it_was_measured_while_the_body_turns() -> None:
    estimator = Estimator()
    for n in range(50):
        turned = 2.0 * n * TICK / SECOND
        estimator.sample(n * TICK, PlanarInertial(0.0, 0.0, turned, 2.0))
        estimator.put(n * TICK, pose=PoseFix(0.0, 0.0, turned - 2.0 * 0.004 + 1.0, 0.004))
    assert estimator.yaw[-1].position == pytest.approx(turned + 1.0, abs=1e-6)


def test_a_yaw_counts_more_the_longer_the_attitudes_zero_has_wandered() -> None:
    estimator = Estimator(NOISE._replace(yaw_walk=0.01), history=200)
    for n in range(103):
        estimator.sample(n * TICK)
        if n in {1, 101}:
            estimator.put(n * TICK, pose=PoseFix(0.0, 0.0, 1.0 if n == 1 else 1.05, 0.0))
        elif n % 10 == 0:
            estimator.put(n * TICK, position=PositionFix(0.0, 0.0, 0.0))
    # 1e-4 rad2 of the first, 1e-4 that it has wandered in a second, 1e-4 of the second
    assert estimator.yaw[-1].position == pytest.approx(1.0 + 0.05 * 2 / 3, abs=1e-4)
