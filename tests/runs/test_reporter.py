"""What a run reports to systemd and the journal."""

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.retuning import changed_keys, need_restart
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.fault_log import CountedFault, FaultLog
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.runs.reporter import AGAIN_AFTER, FaultJournal, Reporter
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.tuning import NEEDED, Reloading
from firmware_runtime.system.messages import Journal, Notices, encoded, watchdog_of
from tests.support.periodic_models import PERIOD, Robot, Sampler
from tests.support.stalling_clock import StallingClock


class Listener:
    """A datagram socket that keeps what it is sent."""

    def __init__(self, path: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.bind(os.fspath(path))

    def received(self) -> list[str]:
        received = []
        while True:
            try:
                received.append(self._socket.recv(65536).decode())
            except BlockingIOError:
                return received

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def systemd(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Listener]:
    listener = Listener(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
    yield listener
    listener.close()


@pytest.fixture
def journald(tmp_path: Path) -> Iterator[Listener]:
    listener = Listener(tmp_path / "journal")
    yield listener
    listener.close()


def test_ready_comes_after_the_first_step_and_a_stall_is_one_line(
    tmp_path: Path, systemd: Listener, journald: Listener
) -> None:
    clock = StallingClock({5: 3 * PERIOD})
    executive = Executive(Robot(), clock, list)
    notices, journal = Notices(), Journal(tmp_path / "journal")
    Reporter(executive, notices, journal, lambda _statistics: "a summary")
    executive.run(30 * PERIOD)
    notices.close()
    journal.close()
    reported = systemd.received()
    assert reported.count("READY=1") == 1
    assert reported.count("STATUS=a summary") == 1
    (line,) = journald.received()
    fields = dict(each.split("=", 1) for each in line.splitlines())
    assert fields["PERIOD_US"] == str(PERIOD // 1000)
    assert (fields["MODEL"], fields["MISSED"], fields["CAUSE"]) == ("imu", "2", "wake")
    assert int(fields["LATE_US"]) == 3 * PERIOD // 1000
    assert fields["PRIORITY"] == "4"


def test_a_loop_that_is_always_late_writes_a_summary_a_minute_and_its_episode_at_the_end(
    tmp_path: Path, journald: Listener
) -> None:
    clock, robot = StallingClock(), Robot(imu=10 * PERIOD)
    robot.imu.work = lambda _number: clock.spend(11 * PERIOD)
    policies = {"imu": ActivationPolicy("catch-up")}
    executive = Executive(robot, clock, list, Configuration(policies, max_lag=NEVER))
    journal = Journal(tmp_path / "journal")
    reporter = Reporter(executive, Notices(), journal, lambda _statistics: "a summary")
    executive.run(150 * SECOND)
    reported = journald.received()
    assert len(reported) == 2
    assert all(entry.startswith("MESSAGE=a summary\n") for entry in reported)
    reporter.close()
    (episode,) = journald.received()
    assert "\nMODEL=imu\n" in episode
    journal.close()


def test_a_run_without_steps_is_not_ready(systemd: Listener) -> None:
    executive = Executive(Robot(), StallingClock(), list)
    notices = Notices()
    reporter = Reporter(executive, notices, Journal(None), lambda _statistics: "")
    reporter.between_steps(0, 0)
    notices.close()
    assert "READY=1" not in systemd.received()


def test_a_manager_that_does_not_read_holds_up_no_run_and_gets_ready_later(
    systemd: Listener, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "1")
    notices = Notices.from_environment()
    for number in range(2000):  # more than any queue holds
        notices.status(f"{number} \N{MICRO SIGN}s")
    notices.ready()
    received = systemd.received()
    assert received[0] == "STATUS=0 \N{MICRO SIGN}s"
    assert len(received) < 2000
    notices.alive()
    assert systemd.received() == ["READY=1", "WATCHDOG=1"]
    notices.alive()
    assert systemd.received() == ["WATCHDOG=1"]
    notices.close()


def test_a_manager_waits_for_settings_that_are_read_again_until_they_are(systemd: Listener) -> None:
    board = registry.load("tachobot")
    session = start_session(board, VirtualClock(), doubles=True, statistics_path=None)
    notices = Notices()
    reloading = Reloading(session.tuning, session.executive, notices, lambda _: None)
    reloading.request()
    reloading.between_steps(0, NEEDED)
    begins, ends = systemd.received()
    assert (begins.partition("\n")[0], ends) == ("RELOADING=1", "READY=1")
    notices.close()
    session.close()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("place", ["", "/nowhere/notify"])
def test_a_manager_that_is_not_there_is_sent_nothing(
    monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", place)
    assert not Notices().is_there


def test_without_systemd_no_notice_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    notices, journal = Notices(), Journal(None)
    assert not notices.is_there
    assert not journal.is_there
    notices.ready()
    journal.write("nothing")
    assert journal.dropped == 0


@pytest.mark.parametrize(
    ("environment", "watchdog"),
    [
        ({}, NEVER),
        ({"WATCHDOG_USEC": "2000000"}, 2 * SECOND),
        ({"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": "1"}, NEVER),
        ({"WATCHDOG_USEC": "soon"}, NEVER),
    ],
)
def test_the_watchdog_is_what_systemd_says_for_this_process(
    environment: dict[str, str], watchdog: int
) -> None:
    assert watchdog_of(environment) == watchdog


def test_a_field_of_several_lines_has_its_length() -> None:
    assert encoded("A", "b") == b"A=b\n"
    assert encoded("A", "b\nc") == b"A\n\x03\x00\x00\x00\x00\x00\x00\x00b\nc\n"


def test_gains_may_change_while_the_robot_runs_and_addresses_may_not() -> None:
    board = registry.load("tachobot")
    other = registry.load("tachobot", ["controller.yaw.kp=0.5", "imu.address=0x69"])
    changed = list(changed_keys(board.settings, other.settings))
    assert changed == ["imu.address", "controller.yaw.kp"]
    assert need_restart(changed, board.retunable) == ["imu.address"]


def test_equal_settings_have_no_changed_keys() -> None:
    assert list(changed_keys(*(registry.load("detective").settings for _ in range(2)))) == []


def test_the_watchdog_is_not_fed_while_logical_time_is_behind_the_clock(
    systemd: Listener, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "1")
    robot, clock = Robot(), StallingClock({10: SECOND})
    executive = Executive(robot, clock, list, Configuration({"imu": ActivationPolicy("catch-up")}))
    notices = Notices.from_environment()
    Reporter(executive, notices, Journal(None), lambda _statistics: "a summary")
    fed: list[bool] = []
    robot.imu.work = lambda _number: fed.append("WATCHDOG=1" in systemd.received())
    executive.run(2 * SECOND)
    notices.close()
    late = [number for number, is_fed in enumerate(fed) if not is_fed]
    # before the first there is no watchdog; after the 89th the 90th has been due for 0.2 s
    assert late == [0, *range(11, 90)]


def test_a_journal_that_has_ended_keeps_no_robot_from_running(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as left:
        left.bind(str(tmp_path / "journal"))
    journal = Journal(tmp_path / "journal")
    journal.write("nobody reads this")
    assert not journal.is_there
    journal.close()


def test_what_utf_8_has_not_is_escaped_for_journal_and_manager(
    tmp_path: Path, journald: Listener, systemd: Listener
) -> None:
    """A fault may quote what came over a serial port; that must not end the run."""
    journal, notices = Journal(tmp_path / "journal"), Notices()
    journal.write("read \udcff")
    notices.status("read \udcff")
    assert "MESSAGE=read \\udcff\n" in journald.received()[0]
    assert systemd.received() == ["STATUS=read \\udcff"]
    journal.close()
    notices.close()


def test_a_fault_is_a_line_when_it_comes_and_at_the_end_with_its_number(
    tmp_path: Path, journald: Listener
) -> None:
    class Failing(Sampler):
        def __init__(self) -> None:
            super().__init__("imu")
            self.fault_out = self.out_port("fault", Fault)

        def output(self) -> None:
            self.fault_out.send(Fault("NotReady", "the robot moved", self.activations + 1))

    journal = Journal(tmp_path / "journal")
    executive = Executive(Failing(), StallingClock(), list)
    reporter = Reporter(executive, Notices(), journal, lambda _statistics: "a summary")
    executive.run(10 * PERIOD)
    (first,) = journald.received()
    for part in ("\nMODEL=imu\n", "\nFAULT=NotReady\n", "\nCOUNT=1\n", "the robot moved"):
        assert part in first
    reporter.close()
    (last,) = journald.received()
    assert "\nCOUNT=11\n" in last
    journal.close()


def test_a_loop_that_is_late_again_and_again_writes_a_line_a_second_with_their_number(
    tmp_path: Path, journald: Listener
) -> None:
    every_other = dict.fromkeys(range(5, 211, 2), 3 * PERIOD)
    executive = Executive(Robot(), StallingClock(every_other), list)
    journal = Journal(tmp_path / "journal")
    reporter = Reporter(executive, Notices(), journal, lambda _statistics: "a summary")
    executive.run(5 * SECOND)
    reporter.close()
    journal.close()
    lines = [line for line in journald.received() if "\nMODEL=imu\n" in line]
    (account,) = (each for each in executive.accounts if each.path == "imu")
    assert len(lines) <= 1 + 5
    counts = [int(line.partition("\nEPISODES=")[2].partition("\n")[0]) for line in lines]
    assert sum(counts) == account.episodes > 2 * len(lines)
    assert counts[0] == 1
    assert f"the last of {counts[1]} episodes" in lines[1]
    assert "the last of 2 episodes" in lines[-1]


class Written(Journal):
    """Keeps what is written: messages, and the number of faults by then."""

    def __init__(self) -> None:
        super().__init__(None)
        self.entries: list[tuple[str, object]] = []

    def write(self, message: str, priority: int = 5, **fields: object) -> None:
        del priority
        self.entries.append((message, fields["COUNT"]))


class Rig:
    def __init__(self) -> None:
        self.faults = FaultLog(Simulator(Atomic("robot")))
        self.journal = Written()
        self.fault_journal = FaultJournal(self.faults, self.journal)

    def report(self, kind: str, times: int = 1) -> None:
        known = [each for each in self.faults.counted if each.kind == kind]
        counted = known[0] if known else CountedFault(kind, path="imu")
        if not known:
            self.faults.counted.append(counted)
        counted.count += times
        counted.sentence = f"sentence {counted.count}"


def test_a_new_kind_is_written_at_once() -> None:
    rig = Rig()
    rig.report("NotReady")
    rig.fault_journal.write_due(0)
    rig.report("BusFault")
    rig.fault_journal.write_due(1)
    assert rig.journal.entries == [
        ("imu: NotReady: sentence 1", 1),
        ("imu: BusFault: sentence 1", 1),
    ]


def test_one_that_goes_on_is_written_seldom_with_its_number() -> None:
    rig = Rig()
    for second in range(21):
        rig.report("NotReady", times=100)
        rig.fault_journal.write_due(second * SECOND)
    assert [count for _, count in rig.journal.entries] == [100, 1100, 2100]
    assert AGAIN_AFTER == 10 * SECOND
    assert "1000 times" in rig.journal.entries[1][0]


def test_one_that_is_over_is_written_no_more() -> None:
    rig = Rig()
    rig.report("NotReady")
    for second in range(100):
        rig.fault_journal.write_due(second * SECOND)
    assert len(rig.journal.entries) == 1


def test_the_end_writes_what_was_held_back() -> None:
    rig = Rig()
    rig.report("NotReady")
    rig.fault_journal.write_due(0)
    rig.report("NotReady", times=3)
    rig.fault_journal.write_due(SECOND)
    rig.fault_journal.close()
    assert [count for _, count in rig.journal.entries] == [1, 4]
