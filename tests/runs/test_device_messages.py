"""What a run says of a device that fails while it is under way, and of its return."""

import re
from collections.abc import Iterator

import pytest

from firmware_runtime import open_board
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.runs.supervision import AGAIN_AFTER, FAILED_AFTER, DeviceMessages
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.rigs.tachobot import TachobotRig

FAILS = r"imu (is not up yet|has failed.*): MPU-9250 at 0x68 on i2c1: no answer; expected WHO_AM_I"


class Tachobot:
    """TachoBot on its doubles in virtual time, and what its run says of its sensor."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.run = open_board(
            "tachobot",
            doubles=True,
            clock="virtual",
            set={"imu.calibration_s": 0.1},
            log=self.heard.append,
        )

    @property
    def said(self) -> list[str]:
        return [each for each in self.heard if each.startswith("imu ")]

    def vanishes_for(self, duration: int) -> None:
        """Its sensor does not acknowledge for so long, and is there for a second then."""
        assert isinstance(self.run.rig, TachobotRig)
        bus = self.run.rig.buses["i2c1"]
        bus.faults = FaultScript([NackAddress(address=0x68, times=None)])
        self.run.run(duration / SECOND)
        bus.faults = FaultScript()
        self.run.run(1.0)


@pytest.fixture
def robot() -> Iterator[Tachobot]:
    robot = Tachobot()
    with robot.run:
        yield robot


def test_a_device_that_fails_is_said_with_its_last_fault_and_so_is_its_return(
    robot: Tachobot,
) -> None:
    robot.run.run(1.0)
    assert robot.said == []
    robot.vanishes_for(SECOND)
    fails, works = robot.said
    assert re.match(FAILS, fails)
    assert re.fullmatch(r"imu works again, after 1\.\d s", works)
    assert not any(isinstance(each, DeviceMessages) for each in robot.run.session.executive.hooks)


def test_a_sample_missed_now_and_then_is_not_said(robot: Tachobot) -> None:
    robot.run.run(1.0)
    for _ in range(5):
        robot.vanishes_for(FAILED_AFTER // 4)
    assert robot.said == []


def test_one_that_fails_again_and_again_is_said_now_and_then(robot: Tachobot) -> None:
    robot.run.run(1.0)
    for _ in range(8):
        robot.vanishes_for(500 * MILLISECOND)
    assert len(robot.said) == 4  # within 1.5 times AGAIN_AFTER
    assert AGAIN_AFTER < 8 * 1500 * MILLISECOND < 2 * AGAIN_AFTER
    assert [bool(re.match(FAILS, each)) for each in robot.said] == [True, False] * 2


def test_one_that_never_came_up_is_for_the_end_to_say(robot: Tachobot) -> None:
    robot.vanishes_for(2 * SECOND)
    assert robot.said == []
