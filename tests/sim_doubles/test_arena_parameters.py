"""The arena's numbers: what is refused, and that all faults are reported at once."""

import math
from typing import Any

import pytest

from sim_doubles.worlds.arena import ArenaParameters


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("head_start_deg", 91.0, "a place between the end stops at 90.0 to either side"),
        ("sonar_nearest_m", 6.0, "more than sonar_nearest_m, which is 6.0"),
        ("target", (1.0, math.nan), "finite x and y"),
        ("obstacles", ((1.0, 2.0, 0.0),), "finite x and y, and a radius above 0"),
        ("walls", ((1.0, 2.0, 1.0, 2.0),), "finite x and y of two different ends"),
    ],
)
def test_what_cannot_be_is_refused_with_what_was_expected(
    name: str, value: object, expected: str
) -> None:
    overrides: dict[str, Any] = {name: value}
    with pytest.raises(ValueError, match=r"^arena: ") as refusal:
        ArenaParameters(**overrides)
    assert f"{expected};" in f"{refusal.value};"


@pytest.mark.parametrize(
    "overrides",
    [
        {"target": (0.0, 0.24)},
        {"obstacles": ((0.0, -0.3, 0.2),)},
        {"walls": ((-1.0, 0.1, 1.0, 0.1),)},
    ],
)
def test_a_start_that_touches_something_is_refused(overrides: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"start is \(0\.0, 0\.0\), expected a place where"):
        ArenaParameters(**overrides)


def test_every_fault_is_listed_at_once() -> None:
    with pytest.raises(ValueError, match=r"^arena: ") as refusal:
        ArenaParameters(head_start_deg=91.0, sonar_nearest_m=6.0, target=(math.inf, 0.0))
    assert [fault.split()[0] for fault in str(refusal.value)[7:].split("; ")] == [
        "head_start_deg",
        "sonar_farthest_m",
        "target",
    ]


def test_shapes_are_the_target_then_obstacles_then_walls() -> None:
    parameters = ArenaParameters(obstacles=((3.0, 3.0, 0.5),), walls=((5.0, 0.0, 5.0, 1.0),))
    target, obstacle, wall = parameters.shapes
    assert parameters.circles == (target, obstacle)
    assert target.distance(2.0, 1.0) == -0.10
    assert wall.distance(6.0, 0.5) == 1.0
    assert parameters.clearance_m((3.0, 2.0)) == pytest.approx(1.0 - 0.5 - 0.15)
