"""Predicates about models and ports whose names Python does not read as names."""

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.debugger.model_state import Models
from firmware_runtime.recording.debugger.predicate import Predicate, Seen


class Nose(Atomic):
    """Sends angles at ports with names of all kinds."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.out_port("angle/rad", float)
        self.out_port("angle", float)
        self.out_port("it's", float)
        self.turns = 3


@pytest.fixture
def models() -> Models:
    """A robot with noses called after words of Python's, and one of two words."""
    robot, head = Coupled("robot"), Coupled("head-1")
    robot.add(head)
    head.tilt = 2  # type: ignore[attr-defined]
    head.add(Nose("import"))
    head.add(Nose("nose tip"))
    robot.add(Nose("5"))
    robot.add(Nose("pass"))
    return Models(robot)


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("head-1.import.angle/rad > 0.5", True),
        ("head-1.import.angle < 0.5", True),
        ("head-1.import.turns == 3", True),
        ("-abs(head-1.nose tip.angle/rad) < 0 and not head-1.nose tip.it's == 2", True),
        ("head-1.nose tip.it's == 1", True),
        ("head-1.nose tip.angle/rad", True),
        ("head-1.import.angle/rad", False),
        ("'head-1.import.angle/rad' == 'head-1.nose tip'", False),
        ("5.angle == 9", True),
        ("pass.turns == 3", True),
        ("head-1.tilt == 2", True),
        ("head-1.import.turns < 5", True),
    ],
)
def test_a_path_is_written_as_it_is(models: Models, text: str, holds: bool) -> None:  # noqa: FBT001 -- a parameter of the test
    seen = Seen()
    seen.last = {
        "head-1.import.angle/rad": 0.7,
        "head-1.import.angle": 0.1,
        "head-1.nose tip.angle/rad": -0.2,
        "head-1.nose tip.it's": 1.0,
        "5.angle": 9.0,
    }
    seen.sent = {"head-1.nose tip.angle/rad"}
    assert Predicate(text, models).holds(seen) is holds


@pytest.mark.parametrize("text", ["head-1.import", "head-1.import.angle/deg > 1", "head-1 > 2"])
def test_what_is_no_port_is_still_refused(models: Models, text: str) -> None:
    with pytest.raises(ConfigError):
        Predicate(text, models)
