"""When things happen, on a clock that stands still unless moved; what a run leaves in its file."""

import json
import socket
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.clocks import S, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.inbox import CAPACITY
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.reader import read_statistics
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


class Bus:
    """Counters as of an accounted bus."""

    name = "i2c1"

    def __init__(self) -> None:
        self.transactions = self.bytes = self.errors = self.retries = self.busy_ns = 0
        self.by_address: dict[int, Any] = {}

    def carry(self, address: int, busy_ns: int) -> None:
        self.transactions += 1
        self.bytes += 10
        self.busy_ns += busy_ns
        device = self.by_address.setdefault(address, SimpleNamespace(busy_ns=0))
        device.busy_ns += busy_ns


@pytest.fixture
def bus() -> Bus:
    return Bus()


def test_another_process_reads_what_the_run_counted(tmp_path: Path) -> None:
    path = tmp_path / "robot.stats"
    run = Run(
        Robot(),
        StallingClock({5: 25 * MILLISECOND}),
        Configuration(statistics_path=path, conditions={"board": "robot", "board_hash": "1f"}),
    )
    run.until(SECOND)
    read = read_statistics(path).as_json()
    assert read == run.json()
    assert (read["scheduled"], read["run"], read["skipped"]) == (101, 99, 2)
    assert read["conditions"]["board"] == "robot"
    assert read["conditions"]["run"]["state"] == "ended"


def test_the_counters_of_a_bus_are_copied_every_step(bus: Bus) -> None:
    robot = Robot()
    run = Run(robot, VirtualClock(), Configuration(buses=[bus]))
    seen: list[int] = []

    def work(_value: int) -> None:
        seen.append(run.json()["bus"]["i2c1"]["transactions"])
        bus.carry(0x40, 100 * MICROSECOND)

    robot.thrust.work = work
    run.until(4 * PERIOD)
    assert seen == [0, 1, 2, 3, 4]
    assert run.json()["bus"]["i2c1"] == {
        "transactions": 5,
        "bytes": 50,
        "errors": 0,
        "retries": 0,
        "utilisation": 0.0125,
    }


def test_the_worst_activations_say_what_they_spent_their_time_on(bus: Bus) -> None:
    robot, clock = Robot(), StallingClock({3: 2 * MILLISECOND})
    run = Run(robot, clock, Configuration(buses=[bus], worst=2))

    def sample(number: int) -> None:
        bus.carry(0x68, 30 * MICROSECOND)
        clock.spend(40 * MICROSECOND)
        if number == 5:
            clock.spend(PERIOD + 500 * MICROSECOND)

    def drive(_value: int) -> None:
        bus.carry(0x40, 60 * MICROSECOND)
        clock.spend(70 * MICROSECOND)

    robot.imu.work, robot.thrust.work = sample, drive
    run.until(SECOND)
    longest, latest = run.json()["worst"]
    assert (longest["t_ns"], latest["t_ns"]) == (5 * PERIOD, 3 * PERIOD)
    assert longest["causes"]["models_us"] == {"imu": 10_540.0, "thrust": 70.0}
    assert latest == {
        "t_ns": 3 * PERIOD,
        "model": "imu",
        "lateness_us": 2000.0,
        "step_us": 110.0,
        "causes": {
            "wake_us": 2000.0,
            "behind_us": 0.0,
            "garbage_us": 0.0,
            "bus_us": {"i2c1": {"0x68": 30.0, "0x40": 60.0}},
            "models_us": {"imu": 40.0, "thrust": 70.0},
        },
    }


def test_lateness_by_an_earlier_step_is_kept_apart_from_waking_late() -> None:
    robot, clock = Robot(imu=PERIOD, compass=PERIOD), StallingClock()
    robot.compass.offset = MILLISECOND
    run = Run(robot, clock)
    robot.imu.work = lambda number: clock.spend(3 * MILLISECOND) if number == 2 else None
    run.until(5 * PERIOD)
    compass = next(each for each in run.json()["worst"] if each["model"] == "compass")
    assert compass["lateness_us"] == compass["causes"]["behind_us"] == 2000
    assert compass["causes"]["wake_us"] == 0


@pytest.mark.parametrize(
    ("offset", "stalls", "cause"),
    [
        (0, {}, "imu"),
        (0, {2: 4 * MILLISECOND}, "wake"),
        (MILLISECOND, {}, "behind"),
    ],
)
def test_where_no_counters_are_read_an_episode_is_explained_by_where_the_time_went(
    offset: int, stalls: dict[int, int], cause: str
) -> None:
    robot, clock = Robot(imu=PERIOD, compass=PERIOD), StallingClock(stalls)
    robot.compass.offset = offset
    run = Run(robot, clock)
    run.executive.simulator.listen(
        robot.imu.sample, lambda _at, number: clock.spend(3 * MILLISECOND * (number == 2))
    )
    run.until(5 * PERIOD)
    assert {each.path: each.cause for each in run.executive.accounts}["compass"] == cause


def test_own_times_of_the_models_add_up_to_the_step() -> None:
    robot, clock = Robot(compass=PERIOD), StallingClock()
    robot.imu.work = lambda _number: clock.spend(3 * MICROSECOND)
    robot.compass.work = lambda _number: clock.spend(5 * MICROSECOND)
    robot.thrust.work = lambda _value: clock.spend(7 * MICROSECOND)
    run = Run(robot, clock)
    run.until(PERIOD)
    for each in run.json()["worst"]:
        assert each["causes"]["models_us"] == {"imu": 3.0, "thrust": 7.0, "compass": 5.0}
        assert each["step_us"] == 15.0
    assert run.model("imu")["step_us"]["max"] == 3.0


def test_virtual_time_has_no_lateness_and_no_worst_activation() -> None:
    run = Run(Robot(), VirtualClock())
    run.until(SECOND)
    assert set(run.json()["lateness_us"].values()) == {None}
    assert run.json()["models"]["imu"]["load"] is None
    assert run.json()["worst"] == []


def test_two_runs_in_virtual_time_leave_the_same_statistics() -> None:
    def statistics() -> str:
        run = Run(Robot(compass=25 * MILLISECOND), VirtualClock())
        run.until(SECOND)
        return json.dumps(run.json())

    assert statistics() == statistics()


def test_conditions_say_what_was_asked_and_what_holds() -> None:
    run = Run(Robot(), VirtualClock())
    run.until(PERIOD)
    conditions = run.json()["conditions"]
    assert conditions["clock"] == "VirtualClock"
    assert conditions["settings"]["fifo_priority"] == {
        "asked": 0,
        "granted": False,
        "reason": "not asked for",
    }
    assert {"kernel", "python", "machine", "scheduler", "governor"} <= conditions.keys()
