"""TachoBot's own models alone: attitude and allocation."""

import math
from itertools import repeat

import numpy as np
import pytest
from firmware_boards.tachobot.allocation import T_PSEUDO_INVERSE, Allocation, T, allocate
from firmware_boards.tachobot.attitude import (
    FIELDS_AT_REST,
    FIELDS_AVERAGED,
    FIELDS_PROVED,
    Attitude,
)
from firmware_drivers.chips.mpu9250_burst import InertialSample
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.motion import Applied, Motion
from tests.support.atomic_bench import AtomicBench

# Attitude -----------------------------------------------------------------------------------------


class Estimator(AtomicBench):
    """An attitude estimator alone; samples come in by hand."""

    def __init__(self, *, compass_s: float = 0.0, enabled: bool = True) -> None:
        super().__init__(Attitude("attitude", round(compass_s * SECOND), enabled=enabled))

    def feel(self, at_ms: int, rate: float, heading: float | None = None) -> None:
        """A sample at that instant; `heading` is how far the body has turned from north."""
        field = None
        if heading is not None:
            field = (20e-6 * math.cos(heading), -20e-6 * math.sin(heading), -40e-6)
        rates = (0.0, 0.0, rate)
        sample = InertialSample((0.0, 0.0, 9.8), rates, field, 25.0, field_overflow=False)
        self.put(at_ms, sample=sample)

    @property
    def yaw(self) -> float:
        return float(self.values("yaw")[-1].position)


def test_rates_are_integrated_by_the_trapezoid_rule_from_where_the_first_sample_finds_it() -> None:
    rig = Estimator()
    rig.feel(0, 0.0)
    assert rig.values("yaw") == [Motion(0.0, 0.0)]
    rig.feel(40, 1.0)
    rig.feel(80, 1.0)
    assert rig.yaw == pytest.approx(0.02 + 0.04)


def test_over_a_gap_the_rate_after_it_counts_as_the_one_before_may_be_a_lie() -> None:
    rig = Estimator()
    rig.feel(0, 0.0)
    rig.feel(40, 8.0)
    rig.feel(1040, 0.5)
    assert rig.yaw == pytest.approx(0.16 + 0.5)


def test_whole_turns_of_a_gap_do_not_count() -> None:
    estimator = Estimator()
    estimator.feel(0, 0.0)
    estimator.feel(40, 0.0)
    estimator.feel(2040, 4.0)
    assert estimator.yaw == pytest.approx(8.0 - math.tau)


@pytest.mark.parametrize(
    ("adrift", "driven", "says"),
    [
        ({"enable": False}, {"enable": True}, 100),
        ({"applied": Applied.NOTHING}, {"applied": Applied.ALL}, 400),
    ],
    ids=["while it is disabled", "while nothing drives it"],
)
def test_whole_turns_that_it_makes_by_itself_do_not_count(
    adrift: dict[str, object], driven: dict[str, object], says: int
) -> None:
    estimator = Estimator()
    for tick in range(400):
        if tick in (50, 350):
            estimator.put(40 * tick, **(adrift if tick == 50 else driven))
        estimator.feel(40 * tick, 1.0)
    assert len(estimator.values("yaw")) == says
    assert estimator.yaw == pytest.approx(399 * 0.04 - 2 * math.tau)


def test_whole_turns_made_before_anything_drives_it_do_not_count() -> None:
    estimator = Estimator()
    estimator.put(1, applied=Applied.NOTHING)
    for tick in range(1, 400):
        if tick == 350:
            estimator.put(40 * tick, applied=Applied.ALL)
        estimator.feel(40 * tick, 1.0)
    assert estimator.yaw == pytest.approx(398 * 0.04 - 2 * math.tau)


N = FIELDS_AVERAGED


@pytest.mark.parametrize(
    ("headings", "yaw_rad", "within"),
    [
        pytest.param(
            [*repeat(2.0, N), *repeat(2.5, 1100 - N)],
            0.5,
            1e-3,
            id="the estimate is pulled to the angle turned since the first field",
        ),
        pytest.param(
            [*(1.0 + (-1) ** n * 0.1 for n in range(N)), *repeat(1.0, 1100 - N)],
            0.0,
            1e-3,
            id="the angle at the start is the mean of the first fields",
        ),
        pytest.param(
            [*repeat(math.pi - 0.1, N), 0.1 - math.pi], 0.2 * 0.01, 1e-8, id="the short way"
        ),
    ],
)
def test_the_compass(headings: list[float], yaw_rad: float, within: float) -> None:
    rig = Estimator(compass_s=1.0)
    for n, heading in enumerate(headings):
        rig.feel(10 * n, 0.0, heading)
    assert rig.yaw == pytest.approx(yaw_rad, abs=within)


def test_without_a_field_or_a_time_constant_the_gyro_stands_alone() -> None:
    rig = Estimator(compass_s=0.0)
    rig.feel(0, 0.0, heading=0.0)
    rig.feel(10, 0.0, heading=1.0)
    assert rig.yaw == 0.0


def test_a_disabled_estimator_says_nothing_until_it_is_enabled() -> None:
    rig = Estimator(enabled=False)
    rig.feel(0, 1.0)
    assert rig.values("yaw") == []
    rig.put(5, enable=True)
    rig.feel(10, 1.0)
    assert rig.values("yaw") == [Motion(0.0, 1.0)]


def test_a_turn_in_a_gap_between_samples_is_not_taken_for_where_it_was_at_first() -> None:
    estimator = Estimator(compass_s=1.0)
    for number in range(FIELDS_AVERAGED // 4):
        estimator.feel(10 * number, 0.0, heading=0.0)
    for number in range(1000):  # it has turned to 1 rad within a second that nothing was felt of
        estimator.feel(1500 + 10 * number, 0.0, heading=1.0)
    assert estimator.yaw == pytest.approx(1.0, abs=0.01)


def test_of_what_a_busy_network_kept_and_brings_at_once_the_last_field_says_where_it_is() -> None:
    estimator = Estimator(compass_s=10.0)
    for number in range(20):
        estimator.feel(10 * number, 0.0, heading=0.0)
    for number in range(40):  # 2 rad/s for 0.4 s
        estimator.feel(600 + number, 2.0, heading=0.02 * number)
    assert estimator.yaw == pytest.approx(0.78, abs=0.01)


def test_of_a_gap_after_the_very_first_sample_its_field_says_where_it_was() -> None:
    estimator = Estimator(compass_s=1.0)
    estimator.feel(0, 0.0, heading=0.5)
    for number in range(1000):
        estimator.feel(1500 + 10 * number, 0.0, heading=1.5)
    assert estimator.yaw == pytest.approx(1.0, abs=1e-6)


def test_what_lied_before_a_gap_is_not_in_where_it_was_at_first() -> None:
    estimator = Estimator(compass_s=1.0)
    for number in range(FIELDS_AT_REST):
        estimator.feel(10 * number, 0.0, heading=0.0)
    for number in range(FIELDS_AT_REST, FIELDS_AVERAGED // 2):  # it turns, and is not felt to
        estimator.feel(10 * number, 0.0, heading=0.01 * number)
    for number in range(1000):
        estimator.feel(1500 + 10 * number, 0.0, heading=1.0)
    assert estimator.yaw == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("fields", "is_lost"), [(FIELDS_PROVED - 1, True), (FIELDS_PROVED, False)])
def test_a_contradiction_ends_the_run_while_it_is_not_certain_where_it_was_at_first(
    fields: int, *, is_lost: bool
) -> None:
    estimator = Estimator(compass_s=1.0)
    for number in range(fields):
        estimator.feel(10 * number, 0.0, heading=0.0)
    sent = len(estimator.values("yaw"))
    estimator.put(10 * fields, trusted=False)
    for late in range(10, 600, 10):
        estimator.feel(10 * fields + late, 0.0, heading=0.0)
    estimator.put(10 * fields + 600, trusted=True)
    estimator.feel(10 * fields + 610, 0.0, heading=0.0)
    assert [each.failed for each in estimator.values("ended")] == [True] * is_lost
    assert len(estimator.values("yaw")) == sent + (not is_lost)


def test_a_moment_of_doubt_ends_nothing() -> None:
    estimator = Estimator(compass_s=1.0)
    for number in range(100):
        estimator.feel(10 * number, 0.0, heading=0.0)
    estimator.put(1000, trusted=False)
    for late in range(10, 150, 10):
        estimator.feel(1000 + late, 0.0, heading=0.0)
    estimator.put(1150, trusted=True)
    for late in range(10, 600, 10):
        estimator.feel(1150 + late, 0.0, heading=0.0)
    assert estimator.values("ended") == []


# Allocation ---------------------------------------------------------------------------------------


COMMANDS = st.floats(-5.0, 5.0)
LIMIT_N = 0.4
MATRIX = np.array(T)


def test_the_pseudo_inverse_is_the_papers_and_meets_commands_within_reach_exactly() -> None:
    expected = [[0.5, 0, 0.5], [0, -0.5, -0.5], [-0.5, 0, 0.5], [0, 0.5, -0.5]]
    assert pytest.approx(np.array(expected), abs=1e-15) == np.array(T_PSEUDO_INVERSE)
    assert pytest.approx(np.linalg.pinv(T), abs=1e-15) == np.array(T_PSEUDO_INVERSE)
    forces = allocate(0.1, -0.2, 0.3, LIMIT_N)[0]
    assert pytest.approx([0.1, -0.2, 0.3], abs=1e-15) == MATRIX @ forces


@settings(max_examples=60)
@given(COMMANDS, COMMANDS, COMMANDS)
def test_saturation_keeps_the_yaw_command_and_the_direction_of_x_and_y(
    x: float, y: float, yaw: float
) -> None:
    forces = allocate(x, y, yaw, LIMIT_N)[0]
    assert max(map(abs, forces)) <= LIMIT_N * (1 + 1e-12)
    got = MATRIX @ forces
    reachable = max(-2 * LIMIT_N, min(2 * LIMIT_N, yaw))
    assert got[2] == pytest.approx(reachable, abs=1e-12)
    assert got[0] * y == pytest.approx(got[1] * x, abs=1e-9)
    assert got[0] * x + got[1] * y >= -1e-12


def test_a_position_command_turns_with_the_body_and_counts_as_zero_if_it_is_not_renewed() -> None:
    bench = AtomicBench(Allocation("allocation", LIMIT_N, timeout=100 * MILLISECOND))
    bench.put(0, yaw=Motion(np.pi / 2, 0.0), x_n=0.2, yaw_n=0.0)
    assert bench.values("forces")[-1] == pytest.approx((0.0, 0.1, 0.0, -0.1), abs=1e-15)
    bench = AtomicBench(Allocation("allocation", LIMIT_N, timeout=100 * MILLISECOND))
    bench.put(0, x_n=0.2, yaw_n=0.0)
    for at_ms, force_n in ((0, 0.1), (100, 0.1), (101, 0.0)):
        bench.put(at_ms, yaw_n=0.0)
        assert bench.values("forces")[-1].f1 == pytest.approx(force_n, abs=1e-15)
