"""A vehicle's velocity becomes two speeds, and ends when it is not renewed."""

import pytest
from firmware_drivers.differential_drive import DifferentialDrive, Velocity
from firmware_drivers.treads import STANDING, TreadSpeeds

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError

TIMEOUT_MS = 500


def driven(velocities: list[tuple[int, Velocity]]) -> list[tuple[int, TreadSpeeds]]:
    """What leaves the drive, as (ms, speeds), for velocities arriving at (ms, velocity)."""
    top = Coupled("top")
    drive = top.add(DifferentialDrive("drive", 0.4, 1.0, TIMEOUT_MS * MILLISECOND))
    cmd_vel = top.in_port("cmd_vel", Velocity)
    top.couple(cmd_vel, drive.velocity)
    simulator = Simulator(top, checked=True)
    left: list[tuple[int, TreadSpeeds]] = []
    simulator.listen(drive.speeds_out, lambda at, speeds: left.append((at // MILLISECOND, speeds)))
    for at_ms, velocity in velocities:
        simulator.run(max(simulator.now, at_ms * MILLISECOND - 1))
        simulator.inject(cmd_vel, velocity)
        simulator.advance(at_ms * MILLISECOND)
    simulator.run(10_000 * MILLISECOND)
    return left


def test_it_turns_to_the_left_with_its_right_side_and_what_is_too_fast_keeps_its_curve() -> None:
    (_, speeds), _ = driven([(0, Velocity(0.5, 1.0))])
    assert speeds == pytest.approx((0.3, 0.7))
    (_, (left, right)), _ = driven([(0, Velocity(2.0, 2.5))])
    assert right == 1.0
    assert left / right == pytest.approx((2.0 - 0.5) / (2.0 + 0.5))


def test_it_stands_when_no_velocity_comes_and_standing_needs_no_renewal() -> None:
    assert driven([(0, Velocity(0.5, 0.0)), (400, Velocity(0.25, 0.0))]) == [
        (0, TreadSpeeds(0.5, 0.5)),
        (400, TreadSpeeds(0.25, 0.25)),
        (900, STANDING),
    ]
    assert driven([(0, Velocity(0.0, 0.0))]) == [(0, STANDING)]


@pytest.mark.parametrize("wrong", [(0.0, 1.0, 1), (0.4, -1.0, 1), (0.4, 1.0, 0)])
def test_what_cannot_be_is_refused(wrong: tuple[float, float, int]) -> None:
    with pytest.raises(SettingError, match="expected more than 0 of each"):
        DifferentialDrive("drive", *wrong)
