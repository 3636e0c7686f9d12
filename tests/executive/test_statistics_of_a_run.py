"""What a run leaves in its file: buses, causes, conditions."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.statistics.reader import read_statistics
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock


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
