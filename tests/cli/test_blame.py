"""`blame` of late activations, and what every reader says of faults."""

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from msgspec import structs

from firmware_runtime.cli.commands import blame
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.statistics.blame import BLAME, CAUSES, BlameRow, Cause
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.history import WorstList
from firmware_runtime.statistics.layout import ELAPSED, HEARTBEAT, STATE, WRITTEN, Layout
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.system.switch_trace import NoTracingError, Switch, Thread
from tests.support.command import Command

LAYOUT = Layout(models=("imu",), timed=("imu",), worst=4, blame=BLAME, causes=CAUSES)
STATED = {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "catch-up"}
LATE = 3_200_000
TAKEN = BlameRow(
    cause=1 + CAUSES.index(Cause.PREEMPTED), explained_ns=3_100_000, of_ns=LATE, run_delay_ns=1
)


class Run:
    """A run under way; it is looked at once before the late activation and once after it."""

    def __init__(self, path: Path) -> None:
        header = {"models": {"imu": STATED}, "conditions": {}, "clock_speed": 1.0}
        self.file = StatisticsFile(LAYOUT, header, path)
        self._worst = WorstList(self.file.cells, LAYOUT)
        self._keep(10 * MILLISECOND)
        self._looks = 0

    def waited(self, _signal: object) -> bool:
        """In the place of the wait: late once, then over."""
        self._looks += 1
        if self._looks == 1:
            self._keep(20 * MILLISECOND)
        else:
            self.file.cells[STATE] = RunState.ENDED
        return False

    def _keep(self, at: int) -> None:
        self.file.open_section()
        self._worst.keep([at, 0, LATE, 90_000, LATE, 0, 0, 0, *structs.astuple(TAKEN)])
        self.file.close_section(at + LATE)


@pytest.fixture
def run(state_directory: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    state_directory.mkdir()
    made = Run(state_directory / "robot.stats")
    monkeypatch.setattr(blame, "_waited", made.waited)
    return made


@pytest.fixture
def untraced(monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def refused(_pid: int) -> Iterator[None]:
        raise NoTracingError("/sys/kernel/tracing: not permitted")
        yield

    monkeypatch.setattr(blame, "switch_trace", refused)


class Trace:
    """In which `stress` took the processor of this process for 3 ms of the late activation.

    Long enough before that and after it `cron` did.
    """

    def __init__(self, run: Run) -> None:
        self._run = run

    def read(self) -> list[Switch]:
        cells = self._run.file.cells
        due = max(cells[WRITTEN], cells[HEARTBEAT]) - cells[ELAPSED] + 20 * MILLISECOND
        loop = Thread("python", os.getpid(), 49)
        over = due + LATE + 90_000
        taken = (
            (due - 700_000, due - 600_000, Thread("cron", 901, 19)),
            (due + 100_000, due + 3_100_000, Thread("stress", 900, 19)),
            (over + 600_000, over + 700_000, Thread("cron", 901, 19)),
        )
        return [
            switch
            for begin, end, other in taken
            for switch in (
                Switch(begin, 1, still_could=True, before=loop, to=other),
                Switch(end, 1, before=other, to=loop),
            )
        ]


@pytest.fixture
def traced(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def granted(_pid: int) -> Iterator[Trace]:
        yield Trace(run)

    monkeypatch.setattr(blame, "switch_trace", granted)


@pytest.mark.usefixtures("run", "traced")
def test_who_ran_instead_is_named(command: Command) -> None:
    ended = command("blame", "robot")
    assert (ended.status, ended.error) == (0, "")
    assert ended.out == (
        "imu at 0.020 s, 3.20 ms late, step 90.0 us: processor taken, 3.10 ms of 3.20 ms; "
        "ran instead: stress (900, FIFO or RR 80) 3.00 ms on CPU 1\n"
    )


@pytest.mark.usefixtures("run", "untraced")
def test_without_the_right_it_is_unknown(command: Command) -> None:
    ended = command("blame", "robot")
    assert ended.status == 0
    assert ended.error == (
        "firmware-runtime: /sys/kernel/tracing: not permitted; what ran instead is unknown\n"
    )
    assert ended.out.endswith("; ran instead: unknown\n")


@pytest.mark.usefixtures("run", "traced")
def test_as_json_it_is_the_entry_of_the_worst_and_who_ran(command: Command) -> None:
    (line,) = command("blame", "robot", "--json").out.splitlines()
    found = json.loads(line)
    assert found["t_ns"] == 20 * MILLISECOND
    assert found["blame"]["cause"] == "processor taken"
    assert [each["pid"] for each in found["ran_instead"]] == [900]


@pytest.mark.usefixtures("untraced")
def test_of_a_run_that_is_over_there_is_what_its_statistics_have(
    command: Command, run: Run
) -> None:
    run.file.cells[STATE] = RunState.ENDED
    ended = command("blame", "robot")
    assert ended.status == 3
    assert ended.out == (
        "imu at 0.010 s, 3.20 ms late, step 90.0 us: processor taken, 3.10 ms of 3.20 ms; "
        "ran instead: unknown\n"
    )
    (said,) = ended.error.splitlines()
    assert "this run is over (ended), after " in said
    assert "; expected one under way, to find what ran instead; 1 of its worst" in said
    (line,) = command("blame", "robot", "--json").out.splitlines()
    assert json.loads(line)["ran_instead"] is None


@pytest.mark.usefixtures("untraced")
def test_of_a_run_whose_process_has_died_it_says_so(
    command: Command, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        blame,
        "read_statistics",
        lambda path: structs.replace(read_statistics(path), writer_alive=False),
    )
    assert run.file.cells[STATE] == RunState.RUNNING
    ended = command("blame", "robot")
    assert (ended.status, "this run is over (died), after " in ended.error) == (3, True)


RESTLESS = (
    *("run", "tachobot", "--doubles", "--clock", "virtual", "--for", 4),
    *("--set", "imu.still_rad_s=0.0001"),
)
SENTENCE = "the robot moved"


@pytest.mark.slow
def test_the_end_says_what_is_wrong_and_so_does_its_json(
    command: Command,
) -> None:
    ended = command(*RESTLESS)
    assert ended.status == 1
    (failed,) = (line for line in ended.out.splitlines() if line.startswith("failed: "))
    for said in (ended.error.splitlines()[0], failed):
        for part in ("imu", "never ready", "not calibrated", SENTENCE):
            assert part in said
    assert "TachoBot did not turn: control never began" in ended.out.splitlines()
    assert re.search(r"fault: imu NotReady 7 times from \S+ s to \S+ s: gyro bias", ended.out)
    ended = command(*RESTLESS, "--json")
    found = json.loads(ended.out)
    assert "never ready" in ended.error
    assert (ended.status, found["ended"]["state"]) == (1, "failed")
    assert SENTENCE in found["ended"]["reason"]
    assert found["result"]["settled"] is False
    counted = found["statistics"]["faults"]["imu"]["NotReady"]
    assert list(counted) == ["count", "first_s", "last_s", "last"]
    assert counted["count"] == 7
    assert 0.7 < counted["first_s"] < counted["last_s"] < 4
    assert SENTENCE in counted["last"]


def test_every_reader_shows_them(command: Command, tmp_path: Path) -> None:
    kept, page = tmp_path / "tachobot.stats", tmp_path / "page.html"
    command(*RESTLESS, "--statistics", kept)
    shown = command.document("stats", "--statistics", kept)
    assert shown["faults"]["imu"]["NotReady"]["count"] == 7
    assert SENTENCE in command("stats", "--statistics", kept).out
    metrics = command("stats", "--statistics", kept, "--prometheus").out
    assert 'faults_total{board="tachobot",kind="NotReady",model="imu"} 7.0' in metrics
    command("report", kept, "-o", page)
    assert SENTENCE in page.read_text()
    compared = command.document("stats", "--diff", kept, kept)["figures"]
    assert compared["faults"] == {"a": 7, "b": 7, "ratio": 1.0}
    assert compared["faults.imu.NotReady"]["a"] == 7


def test_a_run_that_came_to_no_rest_says_why(command: Command) -> None:
    ended = command("run", "tachobot", "--doubles", "--clock", "virtual", "--for", 1)
    assert ended.status == 0
    assert "has not settled: yaw is off by" in ended.out


def test_a_run_that_was_never_armed_says_so(command: Command) -> None:
    arguments = ("--doubles", "--clock", "virtual", "--for", 1, "--supervised")
    ended = command("run", "tachobot", *arguments, "--arm")
    assert ended.status == 0
    assert "never armed, so nothing was driven: the guard is absent" in ended.out
    assert "never armed" in command("run", "tachobot", *arguments).out
