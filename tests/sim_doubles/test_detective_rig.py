"""The detective robot's rig by itself: its chips are driven by hand."""

import math

import pytest
from firmware_boards.detective.settings import DetectiveSettings

from firmware_runtime.board import registry
from firmware_runtime.devs.time import SECOND
from sim_doubles.clock import ManualClock
from sim_doubles.rigs.detective import DetectiveRig

ON, OFF = bytes((0, 0x10, 0, 0)), bytes((0, 0, 0, 0x10))


class Driven:
    """The rig on a clock that stands still, with all that its chips are told."""

    def __init__(self, *assignments: str) -> None:
        settings = registry.load("detective", assignments).settings
        assert isinstance(settings, DetectiveSettings)
        self.settings = settings
        self.clock = ManualClock()
        self.rig = DetectiveRig(settings, self.clock)
        self._bus = self.rig.buses["i2c1"]
        self._bus.write(settings.radar_motor.address, b"\x00\x21")

    def switch(self, *, pwm: bool, in1: bool, in2: bool) -> None:
        """Drive the head's bridge."""
        table = self.settings.radar_motor
        channels = ((table.pwm_channel, pwm), (table.in1, in1), (table.in2, in2))
        for channel, is_on in channels:
            content = ON if is_on else OFF
            self._bus.write(table.address, bytes((6 + 4 * channel,)) + content)

    def head_deg(self) -> float:
        return math.degrees(self.rig.world.head_angle_rad(self.clock()))


def test_its_head_stays_where_it_came_to_as_its_motor_is_switched_off() -> None:
    driven = Driven("world.head_start_deg=0.0")
    driven.switch(pwm=True, in1=False, in2=True)
    driven.clock.advance(2 * SECOND)
    driven.switch(pwm=False, in1=False, in2=False)
    driven.clock.advance(9 * SECOND)
    assert driven.head_deg() == pytest.approx(2 * 55.0, abs=0.1)
