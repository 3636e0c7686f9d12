"""What speaks against arming, and whose absence disarms."""

from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager

import pytest
from msgspec.structs import replace

from firmware_runtime.board import registry
from firmware_runtime.board.configuration import described, input_timeouts
from firmware_runtime.board.ends import end_of
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.runs.arming import Arming, Permission, prearm_checks
from firmware_runtime.runs.requests import LONGEST_S, SHORTEST_S, Leases
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.supervision import Commanders
from firmware_runtime.statistics.file_header import Request, Settings
from firmware_runtime.statistics.layout import ARMED
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot, Sampler
from tests.support.stalling_clock import StallingClock

TENTH = SECOND // 10
ASKED_AT = 6 * SECOND


class Beacon(Atomic):
    """Has an event every 10 ms, and states no period."""

    def initialize(self) -> None:
        self.hold_in("waiting", PERIOD)

    def internal(self) -> None:
        self.hold_in("waiting", PERIOD)


class LateRun:
    """A run of six seconds; `against` is what spoke against arming it then."""

    def __init__(
        self,
        clock: Clock,
        model: Component | None = None,
        *,
        policies: Mapping[str, ActivationPolicy] | None = None,
        max_late_percent: float = 1,
        asked_at: int = ASKED_AT,
    ) -> None:
        configuration = Configuration(policies=policies or {}, max_lag=asked_at)
        self.against: list[str] = []
        self._asked_at = asked_at
        self._executive = Executive(model or Robot(), clock, list, configuration)
        self._executive.hooks.append(self)
        self._checks = prearm_checks(self._executive, max_late_percent)
        self._executive.run(asked_at + TENTH)

    def between_steps(self, now: int, _left: int) -> None:
        """Ask once, as `firmware-runtime arm` does."""
        if now >= self._asked_at:
            self._asked_at = 2 * ASKED_AT
            self.against = [why for ask in self._checks if (why := ask(now)) is not None]

    @property
    def overruns(self) -> int:
        return sum(account.overruns for account in self._executive.accounts)


def test_a_loop_that_has_not_run_for_a_second_fails_the_check() -> None:
    run = LateRun(VirtualClock(), asked_at=SECOND - TENTH)
    assert run.against == ["the rate has not been measured for a second yet"]
    assert LateRun(VirtualClock(), asked_at=SECOND).against == []


@pytest.mark.parametrize(
    ("stalls", "model", "max_late_percent"),
    [
        ({}, Robot(), 1),
        ({}, Robot(), 0),
        ({}, Robot(imu=3 * SECOND), 1),
        ({}, Robot(imu=3 * TENTH), 1),
        ({}, Coupled("nothing"), 1),
        ({550: PERIOD}, Robot(), 1),
        (dict.fromkeys(range(1, 600, 2), 15 * MILLISECOND), Robot(), 100),
    ],
    ids=[
        "on time",
        "on time, and no other is allowed",
        "slower than a second",
        "slow",
        "no period",
        "a whole period late",
        "not judged",
    ],
)
def test_nothing_speaks_against_it(
    stalls: dict[int, int], model: Component, max_late_percent: float
) -> None:
    assert LateRun(StallingClock(stalls), model, max_late_percent=max_late_percent).against == []


def test_activations_late_by_a_tenth_of_a_period_now_and_then_are_none() -> None:
    """As on a machine whose host wakes it late once in a while: it could never be armed before."""
    late = dict.fromkeys(range(60, 600, 110), 2 * MILLISECOND)
    run = LateRun(StallingClock(late))
    assert run.overruns == len(late)
    assert run.against == []


def test_more_late_activations_than_the_board_allows_are_one() -> None:
    late = dict.fromkeys(range(300, 312), 2 * MILLISECOND)
    (why,) = LateRun(StallingClock(late)).against
    assert "2.40 % of the activations" in why
    assert "2.0 ms late" in why
    assert "at most 1 %" in why
    assert "later than a period (10 ms)" in why
    assert LateRun(StallingClock(late), max_late_percent=2.4).against == []


def test_what_was_late_more_than_five_seconds_ago_is_forgotten() -> None:
    late = dict.fromkeys(range(20), 15 * MILLISECOND)
    assert LateRun(StallingClock(late), asked_at=5 * SECOND).against != []
    assert LateRun(StallingClock(late)).against == []


@pytest.mark.parametrize("wait", [100, 550, 599], ids=["oldest", "whole", "under way"])
def test_one_activation_later_than_a_period_is_one_in_any_span(wait: int) -> None:
    late = {wait: 11 * MILLISECOND}
    (why,) = LateRun(StallingClock(late)).against
    assert "11.0 ms late" in why
    assert LateRun(StallingClock(late), max_late_percent=99).against != []


def test_skipped_activations_count_as_late() -> None:
    """A step now and then takes longer than a period: nothing is late, and the next is skipped."""
    clock, robot = StallingClock(), Robot()
    robot.imu.work = lambda number: clock.spend((number % 40 == 0) * 11 * MILLISECOND)
    run = LateRun(clock, robot)
    assert run.overruns == 0
    (why,) = run.against
    assert "late or skipped, the latest came 0.0 ms late" in why
    assert why.startswith("2.40 % ")


def test_a_loop_that_falls_behind_what_is_due_is_one() -> None:
    """Nothing is skipped by this policy: the clock goes on, and what is due waits."""
    clock, robot = StallingClock(), Robot()
    robot.imu.work = lambda _number: clock.spend(20 * MILLISECOND)
    run = LateRun(
        clock, robot, policies={"imu": ActivationPolicy("catch-up")}, max_late_percent=100
    )
    (why,) = run.against
    assert "of the activations due lately came; expected 95%" in why


def test_a_loop_that_is_behind_by_some_activations_keeps_up() -> None:
    run = LateRun(
        StallingClock({597: 3 * PERIOD}),
        policies={"imu": ActivationPolicy("catch-up")},
        max_late_percent=100,
    )
    assert run.against == []


class Lamp(Beacon):
    """A device that does not work."""

    def unready(self) -> str | None:
        return "does not answer"


def test_a_device_that_does_not_work_is_one() -> None:
    model = Coupled("robot")
    model.add(Beacon("beacon"))
    model.add(Lamp("lamp"))
    assert LateRun(VirtualClock(), model).against == ["robot.lamp does not answer"]


class Refused(Executive):
    """A run whose priority was refused."""

    @property
    def granted(self) -> Settings:
        return {"fifo_priority": Request(50, granted=False, reason="not permitted")}


def test_a_priority_that_was_refused_is_one() -> None:
    def against(kind: type[Executive]) -> list[str]:
        executive = kind(Coupled("nothing"), VirtualClock(), list, Configuration())
        return [why for ask in prearm_checks(executive, 1) if (why := ask(SECOND)) is not None]

    assert against(Executive) == []
    assert against(Refused) == ["SCHED_FIFO 50 was requested and not granted (not permitted)"]


def test_of_several_models_the_latest_counts_and_the_shortest_period() -> None:
    """The slow model is late by little of its period, the fast one by more than its own."""
    model = Coupled("robot")
    model.add(Sampler("slow", TENTH))
    model.add(Sampler("fast", PERIOD))
    (why,) = LateRun(StallingClock({550: 15 * MILLISECOND}), model).against
    assert "15.0 ms late" in why
    assert "later than a period (10 ms)" in why


def test_without_a_period_none_is_expected() -> None:
    model = Coupled("robot")
    model.add(Beacon("beacon"))
    (why,) = LateRun(StallingClock(dict.fromkeys(range(300, 400), 2 * MILLISECOND)), model).against
    assert why.endswith("expected at most 1 %")


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


def test_all_that_waits_is_read_before_a_lease_has_run_out(robot: Leased) -> None:
    lease = robot.leases.take(0.5)
    robot.renewals += [("another", round(9.8 * SECOND)), (lease, round(9.8 * SECOND))]
    assert robot.at(10.0)


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


PORT = "yaw_reference"
HALF_S = SECOND // 2


@contextmanager
def commanded(inputs: dict[str, object], said: list[str] | None = None) -> Iterator[Session]:
    """TachoBot on doubles, with something else declared of its inputs."""
    board = replace(registry.load("tachobot"), inputs=inputs)
    log = ([] if said is None else said).append
    session = start_session(board, VirtualClock(), doubles=True, statistics_path=None, log=log)
    try:
        yield session
        session.end()
    finally:
        session.close()


def command(session: Session, *instants: int) -> None:
    for at in instants:
        session.executive.plan(at, session.robot.model.in_ports[PORT], 0.5)


def is_on(session: Session, at: int) -> bool:
    session.run_on(at)
    outputs = session.outputs()
    assert outputs is not None
    return any(outputs.values())


@pytest.mark.parametrize("inputs", [{}, {PORT: 0.5}])
def test_outputs_are_off_from_the_timeout_on_until_the_next_command(
    inputs: dict[str, object],
) -> None:
    said: list[str] = []
    with commanded(inputs, said) as session:
        command(session, 6 * SECOND, 6 * SECOND + HALF_S - 1, 9 * SECOND)
        assert is_on(session, 7 * SECOND - 20 * MILLISECOND)
        assert not is_on(session, 7 * SECOND)
        assert not is_on(session, 9 * SECOND - 1)
        assert is_on(session, 9 * SECOND + HALF_S - 20 * MILLISECOND)
        assert not is_on(session, 10 * SECOND)
        assert session.arming is not None
        assert session.arming.reason == f"no value has come at input {PORT} for 0.5 s"
    assert said.count(f"disarmed: {session.arming.reason}") == 2
    assert not [each for each in said if "falls silent" in each]


def test_an_end_without_hardware_says_what_it_falls_silent_for() -> None:
    board, said = replace(registry.load("tachobot"), inputs={}), list[str]()
    end = end_of(board, "controller")
    session = start_session(
        board, VirtualClock(), doubles=False, statistics_path=None, end=end, log=said.append
    )
    with closing(session):
        command(session, SECOND)
        session.run_on(2 * SECOND)
        assert not session.executive.cells[ARMED], "there is nothing to drive"
        session.end()
    why = f"no value has come at input {PORT} for 0.5 s"
    assert said == [f"falls silent to the end with the outputs: {why}"]


def test_a_port_at_which_nothing_came_yet_commands_nothing() -> None:
    with commanded({}) as session:
        assert is_on(session, 3 * SECOND)


def test_what_holds_its_last_value_never_falls_silent() -> None:
    with commanded({PORT: "hold"}) as session:
        command(session, SECOND)
        assert session.arming is None
        assert is_on(session, 3 * SECOND)


def test_the_same_commands_end_in_the_same_instants_twice() -> None:
    def instants() -> list[bool]:
        with commanded({}) as session:
            command(session, SECOND, 4 * SECOND)
            return [is_on(session, at) for at in range(SECOND, 6 * SECOND, SECOND // 10)]

    assert instants() == instants()


def test_each_port_has_its_own_timeout_and_the_first_silence_counts() -> None:
    model, said = Robot(), list[str]()
    run = Run(model, VirtualClock())
    timeouts = {model.command: SECOND, model.in_ports["replan"]: 2 * SECOND}
    commanders = Commanders(run.executive, timeouts, said.append)
    assert commanders.why_silent(10 * SECOND) is None
    run.executive.plan(0, model.command, 1)
    run.executive.plan(0, model.in_ports["replan"], 1)
    run.until(3 * SECOND)
    assert said == ["no value has come at input command for 1 s"]
    assert commanders.why_silent(SECOND - 1) is None
    assert commanders.why_silent(SECOND) == said[0]


def test_what_a_silence_does_is_said_of_every_port() -> None:
    board = registry.load("tachobot")
    robot = board.unconnected()
    assert input_timeouts(board, robot) == {PORT: None}
    assert described(PORT, None) == "input yaw_reference: holds its last value"
    assert input_timeouts(replace(board, inputs={}), robot) == {PORT: HALF_S}
    expected = "input yaw_reference: outputs are off 0.5 s after its last value"
    assert described(PORT, HALF_S) == expected
