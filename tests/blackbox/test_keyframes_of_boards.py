import math
import random
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import pytest

from firmware_runtime.devs.atomic import Atomic
from tests.support.runs_with_state import RunWithState, run_with_state

BOARDS = [
    ("tachobot",),
    ("tachobot", "controller.mode=free"),
    ("tachobot", "controller.mode=track"),
    ("detective",),
    ("balancing",),
    ("pan_tilt",),
]
pytestmark = pytest.mark.slow


@pytest.mark.parametrize("board", BOARDS, ids=" ".join)
def test_a_robot_that_has_run_on_is_set_back(board: tuple[str, ...]) -> None:
    with run_with_state(*board) as run:
        early, late = run.to(1.0), run.to(2.0)
        table = run.table
        changed = {each.path for each in table.differences(early)}
        assert {"simulator.now", "simulator.last_at"} <= {
            path.partition("[")[0] for path in changed
        }
        for state, other in ((early, late), (late, early), (early, late)):
            table.restore(state)
            assert list(table.differences(state)) == []
            assert {each.path for each in table.differences(other)} == changed


@pytest.mark.parametrize("board", BOARDS, ids=" ".join)
def test_another_robot_of_the_same_board_takes_up_its_state(board: tuple[str, ...]) -> None:
    with run_with_state(*board) as run, run_with_state(*board) as fresh:
        states = [run.to(at_s) for at_s in (0.0, 0.02, 0.6, 1.5)]
        fresh.to(0.004)
        assert fresh.table.fingerprint == run.table.fingerprint
        for state in states:
            assert list(fresh.table.differences(state)) != []
            fresh.table.restore(state)
            assert list(fresh.table.differences(state)) == []


class Place(NamedTuple):
    """A float in a robot's state, which can be changed."""

    path: str
    value: float
    put: Callable[[float], None]


@pytest.mark.parametrize("board", BOARDS, ids=" ".join)
def test_a_float_that_is_one_ulp_off_is_named(board: tuple[str, ...]) -> None:
    with run_with_state(*board) as run:
        state = run.to(2.0)
        places = list(places_of(run))
        chosen = random.Random(14).choices(places, k=100)  # noqa: S311 -- repeatable, not secret
        for path, value, put in chosen:
            put(math.nextafter(value, math.inf))
            (found,) = run.table.differences(state)
            assert (found.path, found.recorded) == (path, value)
            put(value)
        assert list(run.table.differences(state)) == []


def places_of(run: RunWithState) -> Iterator[Place]:
    """Floats in attributes of the robot's own models, in lists and named tuples there."""
    own = run.session.board.build(run.session.hardware.lines).model
    for atomic in run.session.executive.simulator.atomics:
        path = atomic.path.partition(".")[2]
        if path.partition(".")[0] in own.components:
            for name in vars(atomic):
                yield from _in_attribute(atomic, name, f"{path}.{name}")


def _in_attribute(atomic: Atomic, name: str, path: str) -> Iterator[Place]:
    value = getattr(atomic, name)
    if isinstance(value, float):
        yield Place(path, value, lambda new: setattr(atomic, name, new))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            if isinstance(item, float):
                put = lambda new, index=index: value.__setitem__(index, new)  # noqa: E731
                yield Place(f"{path}[{index}]", item, put)
    elif isinstance(value, tuple):
        named: Any = value
        fields: tuple[str, ...] = getattr(value, "_fields", ())
        for field in fields:
            if isinstance(item := getattr(value, field), float):

                def put(new: float, field: str = field) -> None:
                    setattr(atomic, name, named._replace(**{field: new}))

                yield Place(f"{path}.{field}", item, put)
