"""A robot that a process armed is disarmed when that process is gone, or stuck."""

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs.arming import Arming, Permission
from firmware_runtime.runs.requests import LONGEST_S, SHORTEST_S, Leases
from tests.support.periodic_models import Robot


class Leased:
    """An armed robot whose leases go by a clock of the test's."""

    def __init__(self) -> None:
        self.time = 0
        self.renewals: list[tuple[str, int]] = []
        permission = Permission(at_start=False, demand_guard=False)
        self.arming = Arming(Executive(Robot(), VirtualClock()), permission, list)
        self.leases = Leases(self.arming, self._read, lambda: self.time)
        assert self.arming.request(0) == []

    def _read(self) -> bool:
        if not self.renewals:
            return False
        self.leases.renew(*self.renewals.pop(0))
        return True

    def at(self, seconds: float) -> bool:
        """Whether it is armed then."""
        self.time = round(seconds * SECOND)
        self.leases.between_steps(0, 0)
        return self.arming.armed


@pytest.fixture
def robot() -> Leased:
    return Leased()


def test_a_lease_that_runs_out_disarms(robot: Leased) -> None:
    robot.leases.take(0.5)
    assert robot.at(0.49)
    assert not robot.at(0.5)
    assert "no sign for 0.5 s" in robot.arming.reason


def test_a_renewal_begins_the_time_again(robot: Leased) -> None:
    lease = robot.leases.take(0.5)
    assert robot.at(0.4)
    assert robot.leases.renew(lease, robot.time)
    assert robot.at(0.8)
    assert not robot.at(0.9)


def test_a_renewal_that_waits_to_be_read_counts_from_when_it_was_sent(robot: Leased) -> None:
    robot.renewals.append((robot.leases.take(0.5), round(9.8 * SECOND)))
    assert robot.at(10.0)
    assert not robot.at(10.3)


def test_a_renewal_of_a_process_that_may_be_gone_since_is_too_old(robot: Leased) -> None:
    robot.renewals.append((robot.leases.take(0.5), round(9.5 * SECOND)))
    assert not robot.at(10.0)


def test_a_renewal_that_is_read_late_takes_nothing_from_a_newer_one(robot: Leased) -> None:
    lease = robot.leases.take(0.5)
    assert robot.leases.renew(lease, round(0.3 * SECOND))
    assert robot.leases.renew(lease, round(0.1 * SECOND))
    assert robot.at(0.7)


def test_each_of_several_leases_that_runs_out_disarms(robot: Leased) -> None:
    robot.leases.take(0.5)
    other = robot.leases.take(2.0)
    assert not robot.at(0.6)
    assert not robot.leases.renew(other, robot.time)


def test_disarming_ends_all_leases(robot: Leased) -> None:
    lease = robot.leases.take(0.5)
    robot.arming.disarm("requested")
    assert not robot.at(0.1)
    assert not robot.leases.renew(lease, robot.time)
    assert robot.arming.request(0) == []
    assert robot.at(5.0)


def test_a_lease_that_runs_out_while_the_link_is_bad_keeps_it_disarmed(robot: Leased) -> None:
    robot.leases.take(0.5)
    robot.arming.suspend("the controller has been silent")
    assert not robot.at(0.4)
    assert robot.arming.is_wanted
    assert not robot.at(0.6)
    assert not robot.arming.is_wanted
    robot.arming.between_steps(SECOND, 0)
    assert not robot.arming.armed


def test_a_lease_that_is_renewed_lasts_beyond_a_silence_of_the_link(robot: Leased) -> None:
    lease = robot.leases.take(0.5)
    robot.arming.suspend("the controller has been silent")
    assert not robot.at(0.4)
    assert robot.leases.renew(lease, robot.time)
    robot.arming.between_steps(SECOND, 0)
    assert robot.at(0.8)
    assert not robot.at(0.9)


@pytest.mark.parametrize("lease", [[1], {}, 1, None, "", "\ud800"])
def test_what_names_no_lease_renews_none(robot: Leased, lease: object) -> None:
    robot.leases.take(0.5)
    assert not robot.leases.renew(lease, robot.time)


@pytest.mark.parametrize("lease_s", [0, -1, SHORTEST_S / 2, LONGEST_S * 2, "1", True, None, [1]])
def test_a_lease_without_a_sensible_time_is_refused(robot: Leased, lease_s: object) -> None:
    with pytest.raises(ConfigError):
        robot.leases.take(lease_s)
