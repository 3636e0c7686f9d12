"""The detective's mission judges when it is over, by its time too."""

from boards.detective.mission import Mission
from firmware_runtime.board.ending import Ending
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
        self.simulator.listen(
            mission.ended, lambda at, ending: self.endings.append((at / SECOND, ending))
        )

    def run(self, until_s: int) -> None:
        self.simulator.run(until_s * SECOND)


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
