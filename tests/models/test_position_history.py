"""The filter and its history, fed with spans as a truth with known noise makes them."""

import cmath
import math
from random import Random

import numpy as np
import pytest
from numpy.typing import NDArray

from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.position_filter import (
    OFF_GATE,
    TOO_OLD,
    Planar,
    PositionHistory,
    Span,
    Taken,
    corrected,
    innovation,
    predicted,
)
from firmware_runtime.models.position_fix import FixReport, PoseFix, PositionFix
from tests.support.tracked_body import NOISE, TICK, Body

SECONDS = 30
TICKS = 100 * SECONDS


def history(length: int = 60) -> PositionHistory:
    return PositionHistory(length, NOISE, 1e9)


def run(body: Body, fixes_every: int) -> tuple[PositionHistory, list[FixReport], list[float]]:
    """The history after a run, its reports, and the normalized squares of the true errors."""
    kept, reports, squares = history(), list[FixReport](), list[float]()
    for n in range(TICKS):
        begin = body.at
        kept.add(Span(begin, begin + TICK, body.tick()))
        if n % fixes_every == fixes_every - 1:
            reports += kept.insert([Taken(body.at, body.seen(), may_restart=False)])
            assert kept.state is not None
            planar = kept.state.planar
            off = abs(body.position - planar.position) ** 2 / planar.pp
            squares.append(off)
    return kept, reports, squares


KNOWN = Planar(1.0 + 2.0j, 0.3 - 0.1j, 0.02 + 0.05j, 0.5, 0.1 - 0.2j, 0.03j, 0.4, 0.1 + 0.05j, 0.3)


def as_matrices(planar: Planar) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """The state and its whole covariance."""
    p, v, b, pp, pv, pb, vv, vb, bb = planar
    upper = np.array([[pp, pv, pb], [0.0, vv, vb], [0.0, 0.0, bb]])
    return np.array([p, v, b]), upper + np.triu(upper, 1).conj().T


def assert_as_stated(
    planar: Planar, state: NDArray[np.complex128], covariance: NDArray[np.complex128]
) -> None:
    for found, expected in zip(as_matrices(planar), (state, covariance), strict=True):
        assert found == pytest.approx(expected, abs=1e-12)


def test_a_span_takes_the_estimate_on_by_the_matrices_of_its_equations() -> None:
    state, covariance = as_matrices(KNOWN)
    span_s, acceleration, turn = 0.5, 0.7 - 0.2j, cmath.rect(1.0, 0.8)
    by_bias = np.array([-turn * span_s * span_s / 2, -turn * span_s, 0.0])
    step = np.array([[1.0, span_s, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], dtype=complex)
    step[:, 2] += by_bias
    white, walk = NOISE.acceleration**2, NOISE.bias_walk**2
    noise = np.diag([white * span_s**3 / 3, white * span_s, walk * span_s]).astype(complex)
    noise[0, 1] = noise[1, 0] = white * span_s**2 / 2
    after = predicted(KNOWN, acceleration, turn, span_s, NOISE)
    expected = step @ covariance @ step.conj().T + noise
    assert_as_stated(after, step @ state - by_bias * acceleration, expected)


def test_a_position_corrects_the_estimate_by_the_matrices_of_the_filter() -> None:
    state, covariance = as_matrices(KNOWN)
    off, variance = innovation(KNOWN, 1.5 + 1.7j, NOISE)
    assert off == pytest.approx(0.5 - 0.3j)
    assert variance == 0.5 + NOISE.position_m**2
    gain = covariance[:, :1] / variance
    after = corrected(KNOWN, off, variance)
    assert_as_stated(after, state + gain[:, 0] * off, covariance - gain @ covariance[:1])


@pytest.mark.slow
def test_innovations_are_as_large_as_the_filter_says_over_seeded_runs() -> None:
    """Their normalized squares sum up to chi square with two degrees of freedom a fix."""
    runs, total, count = 20, 0.0, 0
    for seed in range(runs):
        _, reports, _ = run(Body(seed), fixes_every=5)
        total += sum(report.normalized for report in reports[1:])
        count += len(reports) - 1
    freedom = 2 * count
    spread = 3.3 * math.sqrt(2 * freedom)  # of chi square, normal at that size: 99.9 %
    assert freedom - spread < total < freedom + spread


@pytest.mark.slow
def test_true_errors_are_as_large_as_the_covariance_says() -> None:
    ends = [run(Body(seed), fixes_every=5)[2][-1] for seed in range(100, 160)]
    freedom = 2 * len(ends)
    assert abs(sum(ends) - freedom) < 3.3 * math.sqrt(2 * freedom)


def test_a_bias_is_found_though_the_body_turns() -> None:
    body = Body(3, rate_rad_s=0.5)
    kept, _, _ = run(body, fixes_every=5)
    assert kept.state is not None
    assert abs(body.bias) > 0.05
    assert kept.state.planar.bias == pytest.approx(body.bias, abs=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_positions_that_come_late_and_out_of_order_count_as_if_they_had_come_at_once(
    seed: int,
) -> None:
    """To the bit: only the instant of a position matters, not when it came."""
    spans, fixes = [], []
    body, random = Body(seed), Random(seed)  # noqa: S311 -- a test's
    for n in range(200):
        spans.append((body.at, body.at + TICK, body.tick()))
        if n % 7 == 3:
            at = body.at - random.randrange(TICK)
            x, y, _ = body.seen()
            fix = PoseFix(x, y, 0.4, 0.0) if n % 2 else PositionFix(x, y, 0.0)
            fixes.append((n, n + random.randrange(1, 40), Taken(at, fix, may_restart=False)))
    at_once, late = history(), history()
    for n, span in enumerate(spans):
        at_once.add(Span(*span))
        late.add(Span(*span))
        at_once.insert([fix for came, _, fix in fixes if came == n])
        late.insert([fix for _, came, fix in fixes if came == n])
    came = max(came for _, came, _ in fixes)
    for n in range(200, came + 1):
        span = (n * TICK, (n + 1) * TICK, spans[-1][2])
        at_once.add(Span(*span))
        late.add(Span(*span))
        late.insert([fix for _, due, fix in fixes if due == n])
    assert late.state is not None
    assert late.state == at_once.state


def test_a_position_older_than_the_history_is_refused_and_changes_nothing() -> None:
    body, kept = Body(1), history(length=20)
    for _ in range(50):
        begin = body.at
        kept.add(Span(begin, begin + TICK, body.tick()))
    kept.insert([Taken(body.at, body.seen(), may_restart=False)])
    before = kept.state
    (report,) = kept.insert([Taken(body.at - 20 * TICK, body.seen(), may_restart=False)])
    assert report == FixReport(False, TOO_OLD, 0.2, 0.0, 0.0, 0.0)
    assert kept.state == before
    (report,) = kept.insert([Taken(body.at - 20 * TICK + 1, body.seen(), may_restart=False)])
    assert report.is_taken
    (report,) = history().insert([Taken(-SECOND, body.seen(), may_restart=False)])
    assert (report.is_taken, report.age_s) == (False, 1.0), "before any sample"


def test_without_positions_the_uncertainty_grows() -> None:
    body, kept = Body(2), history()
    deviations = []
    for n in range(600):
        begin = body.at
        kept.add(Span(begin, begin + TICK, body.tick()))
        if n < 300 and n % 5 == 0:
            kept.insert([Taken(body.at, body.seen(), may_restart=False)])
        if kept.state is not None:
            deviations.append(math.sqrt(kept.state.planar.pp))
    assert deviations[-1] > 5 * deviations[295]
    assert kept.state is not None
    assert abs(kept.state.planar.position - body.position) < 4 * deviations[-1]


def test_a_position_far_off_is_refused_unless_it_may_begin_again() -> None:
    body = Body(4)
    kept = PositionHistory(60, NOISE, 25.0)
    for n in range(100):
        begin = body.at
        kept.add(Span(begin, begin + TICK, body.tick()))
        if n % 5 == 0:
            kept.insert([Taken(body.at, body.seen(), may_restart=False)])
    assert kept.state is not None
    bias = kept.state.planar.bias
    far = PositionFix(100.0, -50.0, 0.0)
    (report,) = kept.insert([Taken(body.at, far, may_restart=False)])
    assert (report.is_taken, report.reason) == (False, OFF_GATE)
    assert abs(kept.state.planar.position) < 10.0
    (report,) = kept.insert([Taken(body.at, far, may_restart=True)])
    assert report.is_taken
    assert kept.state.planar.position == 100.0 - 50.0j
    assert kept.state.planar.bias == bias


def test_the_first_yaw_is_believed_however_narrow_the_gate() -> None:
    kept = PositionHistory(60, NOISE, 0.1)
    kept.add(Span(0, TICK, Body(0).tick()))
    kept.insert([Taken(TICK, PositionFix(1.0, 2.0, 0.0), may_restart=False)])
    (report,) = kept.insert([Taken(TICK, PoseFix(1.0, 2.0, 1.5, 0.0), may_restart=False)])
    assert report.is_taken
    assert kept.state is not None
    assert kept.state.offset_rad == pytest.approx(1.5, abs=0.1)


def test_a_position_without_a_yaw_is_judged_by_its_place_alone_however_narrow_the_gate() -> None:
    kept = PositionHistory(60, NOISE, 0.1)
    kept.add(Span(0, TICK, Body(0).tick()))
    for _ in range(2):
        (report,) = kept.insert([Taken(TICK, PositionFix(1.0, 2.0, 0.0), may_restart=False)])
        assert report.is_taken


def test_a_second_yaw_of_one_instant_counts_as_much_as_the_first() -> None:
    kept = history()
    kept.add(Span(0, TICK, Body(0).tick()._replace(yaw_rad=0.0, yaw_rate_rad_s=0.0)))
    for yaw_rad in (0.2, 0.3):
        kept.insert([Taken(TICK, PoseFix(1.0, 2.0, yaw_rad, 0.0), may_restart=False)])
    assert kept.state is not None
    assert kept.state.offset_rad == pytest.approx(0.25)
    assert kept.state.offset_variance == pytest.approx(NOISE.yaw_rad**2 / 2)


def test_a_yaw_turns_the_axes_and_its_whole_turns_are_of_no_account() -> None:
    """A body whose attitude began at 0 while it really points to y moves along y."""
    for turns in (0, 1, -2):
        kept, random = history(), Random(5)  # noqa: S311 -- a test's
        at, y = 0, 0.0
        for n in range(300):
            kept.add(Span(at, at + TICK, Body(0).tick()._replace(
                forward_m_s2=0.1, left_m_s2=0.0, yaw_rad=0.0, yaw_rate_rad_s=0.0
            )))  # fmt: skip
            at += TICK
            y = 0.05 * (at / SECOND) ** 2
            if n % 5 == 4:
                yaw = math.pi / 2 + turns * math.tau + random.gauss(0, 0.01)
                kept.insert([Taken(at, PoseFix(0.0, y, yaw, 0.0), may_restart=False)])
        assert kept.state is not None
        offset = math.remainder(kept.state.offset_rad - math.pi / 2, math.tau)
        assert offset == pytest.approx(0.0, abs=0.01)
        assert kept.state.planar.position == pytest.approx(1j * y, abs=0.02)
        assert abs(kept.state.planar.bias) < 0.02


def test_two_positions_of_one_instant_count_in_the_order_in_which_they_came() -> None:
    kept = history()
    kept.add(Span(0, TICK, Body(0).tick()))
    fixes = [Taken(TICK, PositionFix(x_m, 2.0, 0.0), may_restart=False) for x_m in (1.0, 1.5)]
    first, second = kept.insert(fixes)
    assert (first.innovation_x_m, first.innovation_y_m, first.normalized) == (0.0, 0.0, 0.0)
    assert (second.innovation_x_m, second.innovation_y_m) == (0.5, 0.0)


def test_two_positions_between_two_samples_count_in_the_order_of_their_origin() -> None:
    body, both_ways = Body(6), (history(), history())
    for _ in range(20):
        begin, sample = body.at, body.tick()
        for kept in both_ways:
            kept.add(Span(begin, begin + TICK, sample))
    early = Taken(body.at - 6_000_000, body.seen(), may_restart=False)
    late = Taken(body.at - 2_000_000, PositionFix(0.3, 0.1, 0.0), may_restart=False)
    both_ways[0].insert([early, late])
    both_ways[1].insert([late])
    both_ways[1].insert([early])
    assert both_ways[0].state is not None
    assert both_ways[0].state == both_ways[1].state
