"""The task of a robot in one run: which of its endings end the run."""

import pytest

from firmware_runtime.board.robot import Ending, Robot
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs.session import Task
from firmware_runtime.statistics.file_header import RunState


class Mission(Atomic):
    """Says after a second that its task is over."""

    def __init__(self, ending: Ending) -> None:
        super().__init__("mission")
        self.ending = ending
        self.ended = self.out_port("ended", Ending)

    def initialize(self) -> None:
        self.hold_in("busy", SECOND)

    def output(self) -> None:
        self.ended.send(self.ending)

    def internal(self) -> None:
        self.passivate()


@pytest.mark.parametrize("ends_on_failure", [True, False])
@pytest.mark.parametrize("failed", [True, False])
def test_a_task_that_is_over_ends_the_run_but_not_by_a_failure_that_the_robot_goes_on_after(
    *, failed: bool, ends_on_failure: bool
) -> None:
    model = Coupled("robot")
    mission = model.add(Mission(Ending("it is over", failed)))
    robot = Robot(model, (), (), ended=mission.ended, ends_on_failure=ends_on_failure)
    executive = Executive(model, VirtualClock())
    task = Task(executive, robot)
    outcome = executive.run(2 * SECOND)
    if failed and not ends_on_failure:
        assert (outcome.state, executive.reached) == (RunState.ENDED, 2 * SECOND)
        assert (task.ending, task.has_failed) == (None, False)
    else:
        assert (outcome.state, executive.reached) == (RunState.STOPPED, SECOND)
        assert (outcome.reason, task.has_failed) == ("it is over", failed)
