"""The guard, look by look, over a run in this process or one that has ended."""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.wire_errors import BusAbsent
from firmware_runtime.runs.guard import Guard, Phase
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import ACKNOWLEDGED, EPOCH, GUARD, HEARTBEAT, STATE, Layout
from firmware_runtime.statistics.takeovers import note_takeover, read_takeovers, takeovers_of
from firmware_runtime.system.process_identity import this_process

HEADER = {"models": {}, "conditions": {"board": "tachobot"}}
STALL = 20 * SECOND
"""Longer than a busy machine holds up a test."""


class Watch:
    """A guard whose chips answer as reported."""

    def __init__(self, path: Path) -> None:
        self.failing: list[str] = []
        self.offs = 0
        self.reported: list[str] = []
        record = partial(note_takeover, path)
        self.against: str | None = None
        self.out_of_reach: BusAbsent | None = None
        self.conditions: Mapping[str, Any] = {}
        self.guard = Guard(path, self, STALL, self.reported.append, record)

    def make_safe(self) -> list[str]:
        self.offs += 1
        return self.failing

    def why_unguarded(self, conditions: Mapping[str, Any]) -> str | None:
        self.conditions = conditions
        return self.against

    def reach(self) -> None:
        if self.out_of_reach is not None:
            raise self.out_of_reach


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.stats"


@pytest.fixture
def watch(path: Path) -> Watch:
    return Watch(path)


@pytest.fixture
def file(path: Path) -> StatisticsFile:
    file = StatisticsFile(Layout(), HEADER, path)
    file.close_section(0)
    return file


@pytest.fixture
def wake_up() -> Iterator[int]:
    descriptor = os.eventfd(0)
    yield descriptor
    os.close(descriptor)


def hang(file: StatisticsFile) -> None:
    file.cells[HEARTBEAT] = monotonic_ns() - 2 * STALL


def come_back(file: StatisticsFile) -> None:
    file.close_section(1)
    file.cells[ACKNOWLEDGED] = file.cells[EPOCH]


def test_without_a_run_it_waits_and_writes_nothing(watch: Watch) -> None:
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WAITING, 0)


def test_a_living_run_is_watched_and_sees_that_it_is(watch: Watch, file: StatisticsFile) -> None:
    before = monotonic_ns()
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WATCHING, 0)
    assert before <= file.cells[GUARD] <= monotonic_ns()


def test_a_run_that_it_could_not_switch_off_is_watched_and_not_marked_guarded(
    watch: Watch, file: StatisticsFile
) -> None:
    watch.against = "its outputs are others"
    for _ in range(2):
        watch.guard.poll()
    assert (watch.guard.phase, file.cells[GUARD]) == (Phase.WATCHING, 0)
    assert watch.conditions == HEADER["conditions"]
    assert watch.reported == [f"this run is not guarded: {watch.against}"]
    hang(file)
    watch.guard.poll()
    assert watch.offs == 1


def test_a_guard_that_may_open_no_bus_ends_and_is_not_seen_by_the_run(
    watch: Watch, file: StatisticsFile
) -> None:
    watch.out_of_reach = BusAbsent("i2c1: /dev/i2c-1 cannot be opened")
    with pytest.raises(BusAbsent):
        watch.guard.poll()
    assert file.cells[GUARD] == 0


def test_a_run_that_has_not_begun_is_not_taken_for_dead(path: Path, watch: Watch) -> None:
    file = StatisticsFile(Layout(), HEADER, path)
    watch.guard.poll()
    assert (watch.guard.phase, file.cells[EPOCH]) == (Phase.WATCHING, 0)


def test_a_hang_is_taken_over_and_held_until_it_is_acknowledged(
    watch: Watch, file: StatisticsFile
) -> None:
    watch.guard.poll()
    hang(file)
    for _ in range(5):
        watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 5)
    assert file.cells[EPOCH] != 0
    come_back(file)
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WATCHING, 7)
    assert watch.reported[-1] == "the run came back, disarmed"


@pytest.mark.parametrize("state", [RunState.ENDED, RunState.STOPPED, RunState.FAILED])
def test_a_run_that_ended_with_its_outputs_off_is_switched_off_and_not_taken_over(
    path: Path, watch: Watch, file: StatisticsFile, state: RunState
) -> None:
    watch.guard.poll()
    file.cells[STATE] = state
    hang(file)
    watch.guard.poll()
    assert watch.offs == 1
    assert watch.reported == ["the run has ended, with all outputs off"]
    assert read_takeovers(path) == []


def test_a_run_that_ended_with_an_output_that_may_be_on_is_taken_over(
    path: Path, watch: Watch, file: StatisticsFile
) -> None:
    path.with_suffix(".settings").touch()
    watch.guard.poll()
    file.cells[STATE] = RunState.STOPPED
    hang(file)
    watch.guard.poll()
    assert [each.failed for each in read_takeovers(path)] == [[]]


def test_an_output_that_cannot_be_switched_off_after_a_run_is_a_takeover(
    path: Path, watch: Watch, file: StatisticsFile
) -> None:
    watch.guard.poll()
    file.cells[STATE] = RunState.STOPPED
    hang(file)
    watch.failing = ["i2c1 0x40: not acknowledged"]
    watch.guard.poll()
    watch.failing = []
    watch.guard.poll()
    assert [each.failed for each in read_takeovers(path)] == [[]]
    assert ["takeover 1" in each for each in watch.reported] == [True, True]


def test_a_run_that_acknowledges_and_does_not_catch_up_stays_held(
    watch: Watch, file: StatisticsFile
) -> None:
    watch.guard.poll()
    hang(file)
    watch.guard.poll()
    file.cells[ACKNOWLEDGED] = file.cells[EPOCH]
    watch.guard.poll()
    assert watch.guard.phase is Phase.HOLDING
    assert len(watch.reported) == 1


def test_a_second_takeover_has_another_epoch_whatever_came_between(
    watch: Watch, file: StatisticsFile
) -> None:
    """Else a run that was armed between the two would not notice the second."""
    watch.guard.poll()
    epochs = []
    for _ in range(2):
        hang(file)
        watch.guard.poll()
        epochs.append(file.cells[EPOCH])
        come_back(file)
        watch.guard.poll()
        file.cells[EPOCH] = file.cells[ACKNOWLEDGED] = 0
    assert len({*epochs, 0}) == 3


def test_a_heartbeat_in_the_future_is_not_believed(watch: Watch, file: StatisticsFile) -> None:
    watch.guard.poll()
    file.cells[HEARTBEAT] = monotonic_ns() + 3600 * SECOND
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 1)
    assert "in the future" in watch.reported[0]


def test_a_heartbeat_that_is_gone_is_not_believed(watch: Watch, file: StatisticsFile) -> None:
    for _ in range(2):
        watch.guard.poll()
    file.cells[HEARTBEAT] = 0
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 1)


def test_a_file_that_is_cut_short_is_a_takeover_and_kills_no_guard(
    path: Path, watch: Watch, file: StatisticsFile
) -> None:
    """A run that has such a file mapped gets SIGBUS, which is why it is taken over."""
    watch.guard.poll()
    del file
    os.truncate(path, 0)
    for _ in range(2):
        watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 2)
    assert "cut short" in watch.reported[0]
    assert "all outputs off" in watch.reported[0]


def test_chips_that_do_not_acknowledge_are_written_again_and_logged_and_kept_once(
    path: Path, watch: Watch, file: StatisticsFile
) -> None:
    watch.guard.poll()
    hang(file)
    watch.failing = ["i2c1 0x40: not acknowledged"]
    for _ in range(3):
        watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 3)
    assert sum("not off: i2c1 0x40: not acknowledged" in each for each in watch.reported) == 1
    (kept,) = read_takeovers(path)
    assert (kept.off_after_ns, kept.failed) == (None, watch.failing)
    watch.failing = []
    come_back(file)
    watch.guard.poll()
    assert "all outputs off" in watch.reported[-2]
    (kept,) = takeovers_of(path, this_process())
    assert (kept.number, kept.failed) == (1, [])
    assert kept.off_after_ns is not None
    assert "no finished step for" in kept.why


def test_the_end_of_the_process_is_noticed_and_the_next_run_watched(
    path: Path, watch: Watch, wake_up: int
) -> None:
    program = (
        "import sys; from pathlib import Path;"
        "from firmware_runtime.statistics.layout import Layout;"
        "from firmware_runtime.statistics.file import StatisticsFile;"
        "file = StatisticsFile(Layout(), {'models': {}, 'conditions': {}}, Path(sys.argv[1]));"
        "print('there', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as run:
        assert run.stdout is not None
        run.stdout.readline()
        watch.guard.poll()
        assert watch.guard.phase is Phase.WATCHING
        run.kill()
        run.wait()
        watch.guard.wait(wake_up)
        watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WAITING, 1)
    assert "has ended" in watch.reported[0]
    StatisticsFile(Layout(), HEADER, path)
    watch.guard.poll()
    assert watch.guard.phase is Phase.WATCHING
