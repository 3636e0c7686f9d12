"""Every mission of the detective robot ends: found, or failed with a sentence, and all off."""

from itertools import cycle
from typing import Protocol, cast

import pytest

from firmware_runtime.devs.time import SECOND
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from tests.support.detective_outage import mission_with_outage
from tests.support.second_choice_board import second_choice_board
from tests.support.virtual_detective import LONGEST_S, VirtualDetective, virtual_detective

pytestmark = pytest.mark.slow

PHASES_S = {"search": 3, "turn": 5.6, "approach": 20}
"""An instant in each phase of the default mission."""


class Supplied(Protocol):
    """A chip whose supply can fail."""

    def power_cycle(self) -> None: ...


def chips_of(robot: VirtualDetective) -> dict[str, Supplied]:
    """Every chip on the bus, with a number where there are two of a kind."""
    wired = robot.rig.buses["i2c1"].targets
    return {
        f"{type(chip).__name__}{number}": cast("Supplied", chip)
        for number, chip in enumerate(wired)
    }


CHIPS = sorted(chips_of(virtual_detective()))


def ends(robot: VirtualDetective) -> bool:
    """Let the mission go on to its end; return whether it was found. Everything stands then."""
    found = robot.run_mission()["found"]
    ((_, ending),) = robot.endings
    assert ending.failed is not found
    assert ending.reason
    robot.run(robot.simulator.now / SECOND + 3)
    assert robot.are_treads_still()
    return bool(found)


@pytest.mark.parametrize(
    ("name", "phase"),
    [
        *(("Md25Double1", phase) for phase in PHASES_S),
        *(pair for pair in zip(CHIPS, cycle(PHASES_S), strict=False) if pair[0] != "Md25Double1"),
    ],
)
def test_a_chip_that_loses_its_supply_for_a_moment(name: str, phase: str) -> None:
    robot = virtual_detective()
    robot.run(PHASES_S[phase])
    chips_of(robot)[name].power_cycle()
    assert ends(robot)


@pytest.mark.parametrize("phase", PHASES_S)
@pytest.mark.parametrize("address", [0x40, 0x58, 0x61, 0x62, 0x73, 0x75])
def test_a_chip_that_answers_no_more(address: int, phase: str) -> None:
    robot = virtual_detective("mission.longest_s=40")
    robot.run(PHASES_S[phase])
    silent = NackAddress(address=address, times=None)
    robot.rig.buses["i2c1"].faults = FaultScript([silent])
    ends(robot)


@pytest.mark.parametrize("phase", ["search", "approach"])
def test_all_chips_lose_their_supply_for_a_moment(phase: str) -> None:
    robot = virtual_detective()
    robot.run(PHASES_S[phase])
    robot.rig.buses["i2c1"].power_cycle()
    ends(robot)


@pytest.mark.parametrize("begins_s", [3.0, 3.2, 3.4])
def test_an_md25_that_loses_its_supply_is_driven_on(begins_s: float) -> None:
    robot = virtual_detective()
    robot.run(begins_s)
    (md25,) = (chip for chip in chips_of(robot).values() if isinstance(chip, Md25Double))
    md25.power_cycle()
    robot.run(begins_s + 1.0)
    assert not robot.are_treads_still()
    assert [fault.consecutive for _, fault in robot.faults] == [1]


@pytest.mark.parametrize(("kind", "within_s"), [(Md25Double, 5), (Pca9685Double, 60)])
def test_a_chip_that_loses_its_supply_again_and_again_fails_the_mission(
    kind: type[Md25Double | Pca9685Double], within_s: float
) -> None:
    """As one does whose motors take too much; every bring-up works, and is for nothing."""
    robot = virtual_detective("world.target=[50.0, 50.0]")
    (chip,) = (chip for chip in chips_of(robot).values() if isinstance(chip, kind))
    at_s = 3.0
    while not robot.endings and at_s < LONGEST_S:
        robot.run(at_s)
        chip.power_cycle()
        at_s += 0.1
    ((at, ending),) = robot.endings
    assert ending.failed
    assert at < (3 + within_s) * SECOND


def test_a_mission_without_a_target_ends_in_time() -> None:
    robot = virtual_detective("world.target=[50.0, 50.0]", "mission.longest_s=20")
    robot.run(30)
    ((at, ending),) = robot.endings
    assert ending.failed
    assert "20 s" in ending.reason
    assert 20 * SECOND <= at <= 22 * SECOND
    assert robot.are_treads_still()


def test_a_sabertooth_that_loses_its_supply_leaves_no_mission_without_an_end(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    board = second_choice_board(tmp_path_factory.mktemp("board"))
    robot = virtual_detective("mission.longest_s=60", board=board)
    robot.run(3)
    line = robot.rig.ports["treads"]
    line._target.power_cycle()  # type: ignore[attr-defined]
    ends(robot)


@pytest.mark.parametrize(
    ("begins_s", "lasts_s"), [(0.2, 0.3), (3.3, 0.3), (5.6, 0.9), (20.0, 0.3), (34.41, 0.3)]
)
def test_a_bus_outage_leaves_nothing_on(begins_s: float, lasts_s: float) -> None:
    mission = mission_with_outage(begins_s, lasts_s)
    assert mission.is_safe
    assert mission.ending is not None


def test_a_bus_that_stays_away_is_given_up_with_a_sentence() -> None:
    mission = mission_with_outage(3.0, 100.0)
    assert mission.outputs_on > 0
    assert any("i2c1" in fault for fault in mission.outcome.faults)
    assert "given up" in mission.outcome.faults[-1]
