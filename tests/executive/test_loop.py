"""When things happen, on a clock that stands still unless moved."""

import socket
from collections.abc import Iterator, Sequence

import pytest

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.clocks import S, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.inbox import CAPACITY
from firmware_runtime.statistics.file_header import RunState
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Actuator, Robot, Sampler
from tests.support.stalling_clock import StallingClock


def received(run: Run, robot: Robot) -> list[tuple[int, object]]:
    """What the IMU sends from now on, with its instants."""
    sent: list[tuple[int, object]] = []
    run.executive.simulator.listen(robot.imu.sample, lambda at, value: sent.append((at, value)))
    return sent


def test_the_end_is_inclusive() -> None:
    robot = Robot()
    run = Run(robot, VirtualClock())
    outcome = run.until(3 * PERIOD)
    assert outcome.state is RunState.ENDED
    assert robot.thrust.received == [0, 1, 2, 3]
    assert run.executive.clock.now() == 3 * PERIOD


def test_the_run_lasts_to_its_end_though_nothing_is_due() -> None:
    clock = VirtualClock()
    outcome = Run(Actuator("thrust"), clock).until(SECOND)
    assert outcome.reason == "the run reached 1.000000000 s"
    assert clock.now() == SECOND


def test_virtual_time_without_an_end_is_over_when_nothing_is_due_any_more() -> None:
    run = Run(Actuator("thrust"), VirtualClock())
    assert run.until(NEVER).state is RunState.ENDED
    assert run.json()["conditions"]["run"]["elapsed_s"] == 0


def test_an_internal_event_happens_at_its_deadline_however_late_the_loop_wakes() -> None:
    robot = Robot()
    run = Run(robot, StallingClock({1: 3 * MILLISECOND}))
    sent = received(run, robot)
    run.until(2 * PERIOD)
    assert sent == [(0, 0), (PERIOD, 1), (2 * PERIOD, 2)]


def test_an_input_happens_when_it_arrives() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    instants: list[int] = []
    robot.thrust.work = lambda _value: instants.append(run.executive.simulator.now)
    clock.at(3, lambda: run.executive.inbox.post(robot.command, 77))
    run.until(PERIOD)
    assert robot.thrust.received == [0, 77, 1]
    assert instants == [0, 3, PERIOD]


def test_an_input_that_arrives_while_events_are_overdue_is_handled_after_them() -> None:
    robot, clock = Robot(), StallingClock({1: 5 * MILLISECOND})
    run = Run(robot, clock)
    instants: list[int] = []
    robot.thrust.work = lambda _value: instants.append(run.executive.simulator.now)
    clock.at(PERIOD + 2, lambda: run.executive.inbox.post(robot.command, 77))
    run.until(2 * PERIOD)
    assert robot.thrust.received == [0, 1, 77, 2]
    assert instants == [0, PERIOD, PERIOD + 2, 2 * PERIOD]


def test_inputs_of_one_stall_are_handled_each_at_its_own_instant() -> None:
    robot, clock = Robot(), StallingClock({1: 5 * MILLISECOND})
    run = Run(robot, clock)
    for later in (1, 2, 3):
        arrival = PERIOD + later * MILLISECOND
        clock.at(arrival, lambda: run.executive.inbox.post(robot.command, 77))
    instants: list[int] = []
    robot.thrust.work = lambda _value: instants.append(run.executive.simulator.now)
    run.until(2 * PERIOD - 1)
    assert instants == [0, PERIOD] + [PERIOD + later * MILLISECOND for later in (1, 2, 3)]


def test_an_input_at_the_instant_of_an_event_joins_it() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    clock.at(PERIOD, lambda: run.executive.inbox.post(robot.replan, 3 * PERIOD))
    sent = received(run, robot)
    run.until(4 * PERIOD)
    assert sent == [(0, 0), (PERIOD, 1), (4 * PERIOD, 2)]


def test_what_was_posted_before_the_run_happens_at_its_start() -> None:
    robot, clock = Robot(), StallingClock()
    clock.instant = 5 * SECOND
    run = Run(robot, clock)
    run.executive.inbox.post(robot.command, 77)
    run.until(PERIOD)
    assert sorted(robot.thrust.received) == [0, 1, 77]


class Datagrams:
    """A socket as a source: each byte is a command."""

    def __init__(self, port: InPort[int]) -> None:
        self.port = port
        self.near, self.far = socket.socketpair(type=socket.SOCK_DGRAM)
        self.near.setblocking(False)

    def fileno(self) -> int:
        return self.near.fileno()

    def receive(self) -> list[tuple[InPort[int], object]]:
        return [(self.port, value) for value in self.near.recv(100)]


@pytest.fixture
def robot() -> Robot:
    return Robot()


@pytest.fixture
def datagrams(robot: Robot) -> Iterator[Datagrams]:
    source = Datagrams(robot.command)
    yield source
    source.near.close()
    source.far.close()


def test_a_source_is_read_while_the_loop_waits(robot: Robot, datagrams: Datagrams) -> None:
    clock = StallingClock()
    run = Run(robot, clock, Configuration(sources=[datagrams]))
    clock.at(5, lambda: datagrams.far.send(bytes([7, 8])))
    run.until(PERIOD)
    assert robot.thrust.received == [0, 7, 8, 1]


def test_a_source_is_read_even_when_the_loop_is_always_late(
    robot: Robot, datagrams: Datagrams
) -> None:
    clock = StallingClock()
    run = Run(robot, clock, Configuration(sources=[datagrams]))
    robot.imu.work = lambda _number: clock.spend(3 * PERIOD)
    clock.at(4 * PERIOD, lambda: datagrams.far.send(bytes([7])))
    run.until(8 * PERIOD)
    assert 7 in robot.thrust.received


def test_a_flood_is_dropped_and_counted_not_kept(robot: Robot) -> None:
    run = Run(robot, VirtualClock())
    posted = [run.executive.inbox.post(robot.command, 1) for _ in range(CAPACITY + 5)]
    assert posted == [True] * CAPACITY + [False] * 5
    run.until(PERIOD)
    assert len(robot.thrust.received) == CAPACITY + 2
    assert run.json()["conditions"]["run"]["inputs_dropped"] == 5


def test_the_loop_shows_that_it_is_alive_while_nothing_is_due() -> None:
    class Impatient(VirtualClock):
        """Returns from a wait half way, as a real clock does after its longest wait."""

        def wait(self, until: int, sources: Sequence[S]) -> list[S]:
            return super().wait(self._now + max((until - self._now) // 2, 1), sources)

    run = Run(Actuator("thrust"), Impatient())
    run.until(1000)
    statistics = run.executive.statistics
    assert statistics.cells[0] > 10
    assert statistics.as_json()["conditions"]["run"]["steps"] == 0


def test_a_run_cannot_be_repeated() -> None:
    run = Run(Sampler("imu"), VirtualClock())
    run.until(PERIOD)
    with pytest.raises(RuntimeError, match="cannot be repeated"):
        run.until(2 * PERIOD)
    assert run.made_safe == 2
