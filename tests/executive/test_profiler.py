"""What watches a run is one instrument: one frame around each function of a model."""

import sys
from types import FrameType

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.functions import FUNCTIONS
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import PathDeadline
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Sampler
from tests.support.stalling_clock import StallingClock

EXECUTIVE = "firmware_runtime.executive."
SIMULATOR = "firmware_runtime.devs.simulator"


def frames_around() -> tuple[str, ...]:
    """The modules of the frames between the simulator and the function that calls this."""
    modules: list[str] = []
    frame: FrameType | None = sys._getframe(2)
    while frame is not None and frame.f_globals["__name__"] != SIMULATOR:
        modules.append(frame.f_globals["__name__"].removeprefix(EXECUTIVE))
        frame = frame.f_back
    return tuple(modules)


class Seen(Atomic):
    """Holds for a period, whatever comes; notes what stands around each of its functions."""

    def __init__(self, period: int) -> None:
        super().__init__("seen")
        self.period = period
        self.into = self.in_port("into", int)
        self.around: dict[str, set[tuple[str, ...]]] = {}

    def initialize(self) -> None:
        self.hold_in("waiting", PERIOD)

    def output(self) -> None:
        self.around.setdefault("output", set()).add(frames_around())

    def internal(self) -> None:
        self.around.setdefault("internal", set()).add(frames_around())
        self.hold_in("waiting", PERIOD)

    def external(self, elapsed: int) -> None:
        self.around.setdefault("external", set()).add(frames_around())
        self.continue_(elapsed)

    def confluent(self) -> None:
        self.around.setdefault("confluent", set()).add(frames_around())
        self.hold_in("waiting", PERIOD)


@pytest.mark.parametrize("period", [PERIOD, NEVER])
def test_nothing_stands_between_the_simulator_and_a_function_of_a_model(period: int) -> None:
    root, seen, sampler = Coupled("root"), Seen(period), Sampler("sampler", 2 * PERIOD // 5)
    root.add(sampler)
    root.add(seen)
    root.couple(sampler.sample, seen.into)
    deadline = PathDeadline("path", sampler.sample, seen, PERIOD)
    watched = Configuration(deadlines=[deadline])
    assert Run(root, StallingClock(), watched).until(10 * PERIOD).error is None
    assert seen.around == {each: {()} for each in FUNCTIONS}


@pytest.mark.parametrize("period", [0, -PERIOD, 0.5])
def test_a_period_that_is_no_time_is_refused(period: int) -> None:
    with pytest.raises(ConfigError):
        Run(Seen(period), VirtualClock())
