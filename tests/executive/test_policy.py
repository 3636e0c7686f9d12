import math

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.policy import ActivationPolicy


def test_the_tolerance_is_a_tenth_of_the_period_unless_stated() -> None:
    assert ActivationPolicy().tolerance(10 * MILLISECOND) == MILLISECOND
    assert ActivationPolicy(tolerance_us=1.5).tolerance(10 * MILLISECOND) == 1500


def test_only_policy_stop_stops() -> None:
    assert ActivationPolicy("stop", stop_after_us=2.5).stop_after() == 2500
    assert ActivationPolicy("catch-up").stop_after() == NEVER


@pytest.mark.parametrize("policy", [("stop", None), ("skip", 5), ("catch-up", 5)])
def test_a_limit_belongs_to_policy_stop_and_to_no_other(policy: tuple[str, float | None]) -> None:
    kind, limit = policy
    with pytest.raises(ValueError, match="stop_after_us belongs to policy stop"):
        ActivationPolicy(kind, stop_after_us=limit)  # type: ignore[arg-type]


@pytest.mark.parametrize("number", [0, -1, math.nan, math.inf])
def test_numbers_that_are_no_spans_are_refused(number: float) -> None:
    with pytest.raises(ValueError, match=r"tolerance_us = .*expected a positive number"):
        ActivationPolicy(tolerance_us=number)
    with pytest.raises(ValueError, match=r"stop_after_us = .*expected a positive number"):
        ActivationPolicy("stop", stop_after_us=number)
