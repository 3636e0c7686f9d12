"""The values of a row: of seed, row and key alone; grids in all combinations; Latin hypercubes."""

from itertools import product

import pytest
from msgspec.structs import replace

from firmware_runtime.lab.sweeps.plan import Sweep

DRAWN = Sweep(board="b", vary={"world.a": "uniform(0, 1)", "world.b": "uniform(0, 1)"}, runs=20)


def test_a_value_depends_on_seed_row_and_key_alone() -> None:
    other_way_round = replace(DRAWN, vary=dict(reversed(DRAWN.vary.items())), runs=1000)
    for row in (7, 0, 19):
        assert DRAWN.values(row) == other_way_round.values(row)
    found = {DRAWN.values(row)[key] for row, key in product(range(20), DRAWN.vary)}
    assert len(found) == 40
    assert replace(DRAWN, seed=1).values(0) != DRAWN.values(0)


def test_keys_stay_in_the_order_in_which_they_were_named() -> None:
    assert list(DRAWN.values(3)) == ["world.a", "world.b"]


def test_a_grid_is_gone_through_in_all_combinations_the_last_key_fastest() -> None:
    grid = Sweep(board="b", vary={"a": "range(2)", "b": "linspace(0, 1, 3)", "c": "uniform(0, 1)"})
    assert grid.size == 6
    points = [(values["a"], values["b"]) for values in map(grid.values, range(6))]
    assert points == list(product((0, 1), (0.0, 0.5, 1.0)))


def test_more_runs_begin_the_grid_again_and_fewer_leave_it() -> None:
    grid = Sweep(board="b", vary={"a": "range(3)", "b": "uniform(0, 1)"}, runs=7)
    assert [grid.values(row)["a"] for row in range(7)] == [0, 1, 2, 0, 1, 2, 0]
    assert len({grid.values(row)["b"] for row in range(7)}) == 7
    assert grid.has_grid_left_over
    assert not replace(grid, runs=6).has_grid_left_over


def test_without_a_grid_nothing_says_how_many_runs_there_are() -> None:
    assert replace(DRAWN, runs=None).size == 0


@pytest.mark.parametrize("key", ["world.a", "world.b"])
def test_a_latin_hypercube_has_one_row_in_each_part_of_each_key(key: str) -> None:
    values = [replace(DRAWN, sampling="lhs").values(row)[key] for row in range(20)]
    parts = [int(20 * value) for value in values if isinstance(value, float)]
    assert sorted(parts) == list(range(20))
    assert parts != sorted(parts)
