"""The propellers, where they only turn the body: the short way gives the very numbers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_doubles.worlds.propellers import PropellerPairs

duties = st.floats(0.0, 1.0)
spans = st.floats(0.0, 0.2)


@pytest.mark.slow
@given(st.lists(st.tuples(duties, duties, spans), min_size=1, max_size=6), st.floats(0.1, 20.0))
def test_pairs_that_push_alike_turn_as_four_pairs_do(
    pushes: list[tuple[float, float, float]], thrust_n: float
) -> None:
    pairs, plain = PropellerPairs(thrust_n, 0.03), PropellerPairs(thrust_n, 0.03)
    for duty, back, elapsed_s in pushes:
        for each in (pairs, plain):
            each.hold((duty, back, back, duty, duty, back, back, duty))
        force = plain.turning(2.7)
        plain.advance(elapsed_s)
        assert pairs._only_turns
        assert pairs.turn_for(2.7, elapsed_s) == (force.settled, force.single, force.double)
        assert pairs._speeds == plain._speeds


@given(st.lists(duties, min_size=8, max_size=8), spans)
def test_a_pair_that_pushes_otherwise_is_seen(first: list[float], elapsed_s: float) -> None:
    pairs, plain = PropellerPairs(0.4, 0.03), PropellerPairs(0.4, 0.03)
    for held in (first, [0.6, 0.4, 0.4, 0.6] * 2):
        for each in (pairs, plain):
            each.hold(held)
        force = plain.turning(1.0)
        plain.advance(elapsed_s)
        assert pairs.turn_for(1.0, elapsed_s) == (force.settled, force.single, force.double)
        assert pairs._speeds == plain._speeds
