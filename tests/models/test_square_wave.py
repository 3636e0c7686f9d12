"""A square wave that is sampled: its levels, and that what it pushes comes back."""

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.plant import SecondOrderPlant
from firmware_runtime.models.square_wave import SquareWave, Wave
from tests.support.atomic_bench import AtomicBench

WAVE = Wave(amplitude=2.0, period=4 * SECOND, begin=SECOND, cycles=2)


def test_its_levels_and_their_edges() -> None:
    at = {0: 0, 999: 0, 1000: 2, 1999: 2, 2000: -2, 3999: -2, 4000: 2, 5999: 2, 6000: -2}
    at |= {7999: -2, 8000: 2, 8999: 2, 9000: 0, 99_000: 0}
    assert {ms: WAVE.level(ms * MILLISECOND) for ms in at} == at


def test_a_free_body_comes_back_to_rest_where_it_began() -> None:
    plant, state = SecondOrderPlant(gain=5.0), (0.0, 0.0, 0.0)
    for number in range(1000):
        state = plant.after(state, WAVE.level(number * 10 * MILLISECOND), 0.01)  # type: ignore[assignment]
    assert state[:2] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_every_tick_is_answered_at_once_with_the_level_of_its_instant() -> None:
    bench = AtomicBench(SquareWave("wave", float, WAVE))
    for at_ms in (500, 1500, 2500, 9500):
        bench.meet(at_ms, tick=0.0)
    bench.run(10_000)
    assert bench.said["level"] == [(500, 0.0), (1500, 2.0), (2500, -2.0), (9500, 0.0)]
