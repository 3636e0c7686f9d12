"""The detective's mission judges when it is over, by its time too."""

import pytest
from firmware_boards.detective.mission import Mission

from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import SECOND

LONGEST = 20 * SECOND


class Watched:
    """A mission alone, with an interlock that can be taken back; `endings` and their seconds."""

    def __init__(self) -> None:
        self.may_move = True
        self.endings: list[tuple[float, Ending]] = []
        mission = Mission("mission", SECOND, 5, LONGEST, lambda: self.may_move)
        self.simulator = Simulator(mission)
        self.treads = {"right": mission.right, "left": mission.left}
        self.simulator.listen(
            mission.ended, lambda at, ending: self.endings.append((at / SECOND, ending))
        )

    def run(self, until_s: int) -> None:
        self.simulator.run(until_s * SECOND)

    def command(self, *commands: tuple[str, int]) -> None:
        """Commands to the treads, one by one, as a link delivers them."""
        for tread, signal in commands:
            self.simulator.inject(self.treads[tread], signal)
            self.simulator.run(self.simulator.now)


def test_a_mission_that_takes_too_long_has_failed_once() -> None:
    watched = Watched()
    watched.run(20)
    assert watched.endings == []
    watched.run(100)
    ((at_s, ending),) = watched.endings
    assert at_s == 21
    assert ending.failed
    assert "20 s" in ending.reason


def test_time_while_disarmed_does_not_count() -> None:
    watched = Watched()
    watched.may_move = False
    watched.run(1000)
    watched.may_move = True
    watched.run(1019)
    assert watched.endings == []
    watched.run(1030)
    assert len(watched.endings) == 1


FORWARD = (("right", 1), ("left", 1))
STOP = (("right", 0), ("left", 0))
TURN = (("right", 2), ("left", 1))
ON = (("right", 1),)


@pytest.mark.parametrize(
    "first_stop", [STOP, STOP[::-1], STOP[:1], STOP[1:], ()], ids=lambda stop: f"arrived {stop}"
)
def test_the_target_is_reached_whatever_a_link_delivered_of_the_stop_before_the_turn(
    first_stop: tuple[tuple[str, int], ...],
) -> None:
    watched = Watched()
    watched.run(2)
    watched.command(*FORWARD, *first_stop, *TURN, *ON)
    watched.run(3)
    assert watched.endings == []
    watched.command(*STOP)
    watched.run(4)
    ((_, ending),) = watched.endings
    assert not ending.failed


def test_a_robot_that_only_stopped_has_not_reached_its_target() -> None:
    watched = Watched()
    watched.run(2)
    watched.command(*FORWARD, *STOP)
    watched.run(10)
    assert watched.endings == []
