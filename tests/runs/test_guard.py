"""The guard, poll by poll: it watches a run, takes over, and nothing keeps it from the outputs."""

import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest
from msgspec.structs import asdict

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.hal.wire_errors import BusAbsent
from firmware_runtime.runs import guard, watched_run
from firmware_runtime.runs.guard import ASK_AGAIN_EVERY, HOLD_AGAIN_AFTER, POLL_EVERY, Guard, Phase
from firmware_runtime.runs.watched_run import WatchedRun, is_readable, keep_clear_of_other_runs
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import STATISTICS, RunState
from firmware_runtime.statistics.layout import ACKNOWLEDGED, EPOCH, GUARD, HEARTBEAT, STATE, Layout
from firmware_runtime.statistics.mapped_file import PREFIX
from firmware_runtime.statistics.takeovers import (
    Takeover,
    note_takeover,
    read_takeovers,
    takeovers_of,
)
from firmware_runtime.system.reserve import SIZE
from firmware_runtime.system.this_process import this_process

HEADER = {"models": {}, "conditions": {"board": "tachobot", "switched_off": ["here: 00"]}}
STALL = 20 * SECOND
"""Longer than a busy machine holds up a test."""
ERRORS = [KeyError("x"), TypeError("x"), OverflowError(), MemoryError(), RecursionError()]
ERRORS += [OSError()]


class Watch:
    """A guard and what it does, in order; chips answer, and parts raise, as the test says."""

    def __init__(self, path: Path) -> None:
        self.done: list[str] = []
        self.raising: dict[str, Exception] = {}
        self.failing: list[str] = []
        self.reported: list[str] = []
        self.against: str | None = None
        self.conditions: Mapping[str, Any] = {}
        self._path = path
        self.guard = Guard(path, self, STALL, self.log, self.record)

    @property
    def offs(self) -> int:
        return self.done.count("off")

    def _do(self, what: str) -> None:
        self.done.append(what)
        if what in self.raising:
            raise self.raising[what]

    def make_safe(self) -> list[str]:
        self._do("off")
        return self.failing

    def why_unguarded(self, conditions: Mapping[str, Any]) -> str | None:
        self._do("why_unguarded")
        self.conditions = conditions
        return self.against

    def reach(self) -> None:
        self._do("reach")

    def log(self, what: str) -> None:
        self._do("log")
        if not what.startswith("watching the run of process "):
            self.reported.append(what)

    def record(self, takeover: Takeover) -> None:
        self._do("record")
        note_takeover(self._path, takeover)


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


def test_a_living_run_is_waited_for_and_watched_and_sees_that_it_is(
    path: Path, watch: Watch
) -> None:
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WAITING, 0)
    file = StatisticsFile(Layout(), HEADER, path)
    watch.guard.poll()
    assert (watch.guard.phase, file.cells[EPOCH]) == (Phase.WATCHING, 0)  # it has not begun
    file.close_section(0)
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
    watch.raising["reach"] = BusAbsent("i2c1: /dev/i2c-1 cannot be opened")
    with pytest.raises(BusAbsent):
        watch.guard.poll()
    assert file.cells[GUARD] == 0


def test_a_hang_is_taken_over_and_held_until_it_is_acknowledged(
    watch: Watch, file: StatisticsFile
) -> None:
    watch.guard.poll()
    hang(file)
    for _ in range(5):
        watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 5)
    assert file.cells[EPOCH] > 0, "below are those that a person requested"
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


@pytest.mark.parametrize(
    ("heartbeat", "said"),
    [(3600 * SECOND, "in the future"), (None, "is gone")],
    ids=["ahead", "gone"],
)
def test_a_heartbeat_in_the_future_or_gone_is_not_believed(
    watch: Watch, file: StatisticsFile, heartbeat: int | None, said: str
) -> None:
    for _ in range(2):
        watch.guard.poll()
    file.cells[HEARTBEAT] = 0 if heartbeat is None else monotonic_ns() + heartbeat
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 1)
    assert said in watch.reported[0]


@pytest.mark.parametrize("silent", [0, STALL])
def test_a_run_whose_last_step_ended_just_now_or_as_long_ago_as_is_allowed_is_not_lost(
    path: Path, file: StatisticsFile, monkeypatch: pytest.MonkeyPatch, silent: int
) -> None:
    monkeypatch.setattr(watched_run, "monotonic_ns", lambda: file.cells[HEARTBEAT] + silent)
    run = WatchedRun(path)
    assert run.why_lost(STALL) == ""
    assert not run.was_disarmed_by_request
    run.close()


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
    assert 0 <= kept.off_after_ns <= monotonic_ns() - kept.at_ns
    assert "no finished step for" in kept.why


def test_what_keeps_outputs_on_is_named_until_they_are_off(
    watch: Watch, file: StatisticsFile
) -> None:
    watch.guard.poll()
    hang(file)
    watch.failing = ["i2c1 0x40: not acknowledged"]
    watch.guard.poll()
    assert watch.guard.failed == watch.failing
    watch.raising["off"] = OverflowError()  # which has no text
    watch.guard.poll()
    assert watch.guard.failed == ["OverflowError"]
    watch.raising["off"] = OSError("no bus")
    watch.guard.poll()
    assert watch.guard.failed == ["no bus"]
    del watch.raising["off"]
    come_back(file)
    watch.guard.poll()  # the chips still fail
    assert (watch.guard.phase, watch.guard.failed) == (Phase.HOLDING, watch.failing)
    watch.failing = []
    watch.guard.poll()
    assert (watch.guard.phase, watch.guard.failed) == (Phase.WATCHING, [])


@pytest.fixture
def other(path: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """Another process that keeps its statistics at the path, until it is killed."""
    program = (
        "import sys; from pathlib import Path;"
        "from firmware_runtime.statistics.layout import Layout;"
        "from firmware_runtime.statistics.file import StatisticsFile;"
        f"file = StatisticsFile(Layout(), {HEADER!r}, Path(sys.argv[1]));"
        "print('there', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as run:
        assert run.stdout is not None
        run.stdout.readline()
        yield run
        run.kill()


def test_the_end_of_the_process_is_noticed_and_the_next_run_watched(
    path: Path, watch: Watch, wake_up: int, other: "subprocess.Popen[bytes]"
) -> None:
    watch.guard.poll()
    assert watch.guard.phase is Phase.WATCHING
    other.kill()
    other.wait()
    watch.guard.wait(wake_up)
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WAITING, 1)
    assert "has ended" in watch.reported[0]
    StatisticsFile(Layout(), HEADER, path)
    watch.guard.poll()
    assert watch.guard.phase is Phase.WATCHING


def test_the_end_of_a_process_wakes_who_waits_for_it(
    path: Path, other: "subprocess.Popen[bytes]"
) -> None:
    run = WatchedRun(path)
    assert not is_readable(run.ends, 0)
    other.kill()
    other.wait()
    assert is_readable(run.ends, 0)
    assert run.has_ended
    assert run.ends == []


def test_no_other_run_is_watched_before_the_outputs_of_the_last_one_are_off(
    path: Path, watch: Watch, other: "subprocess.Popen[bytes]"
) -> None:
    watch.guard.poll()
    watch.failing = ["i2c1 0x40: not acknowledged"]
    other.kill()
    other.wait()
    watch.guard.poll()
    StatisticsFile(Layout(), HEADER, path)
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 2)
    watch.failing = []
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WATCHING, 3)


def test_a_poll_without_an_event_is_waited_for_also_where_there_is_no_run(
    watch: Watch, file: StatisticsFile, wake_up: int
) -> None:
    del file
    for _ in range(2):
        before = monotonic_ns()
        watch.guard.wait(wake_up)
        assert monotonic_ns() - before >= POLL_EVERY
        watch.guard.poll()


class Time:
    """The guard's own clock, as a test moves it."""

    now = 100 * SECOND


@pytest.fixture
def time(monkeypatch: pytest.MonkeyPatch) -> Time:
    time = Time()
    monkeypatch.setattr(guard, "monotonic_ns", lambda: time.now)
    return time


def test_what_keeps_a_run_from_being_guarded_is_checked_again_now_and_then_until_nothing_does(
    watch: Watch, file: StatisticsFile, time: Time
) -> None:
    def poll_twice() -> int:
        watch.guard.poll()
        watch.guard.poll()
        return watch.done.count("why_unguarded")

    watch.against = "its outputs are others"
    assert poll_twice() == 1
    watch.against = None
    assert (poll_twice(), file.cells[GUARD]) == (1, 0)
    time.now += ASK_AGAIN_EVERY
    assert poll_twice() == 2
    assert file.cells[GUARD] != 0
    time.now += ASK_AGAIN_EVERY
    assert poll_twice() == 2


def test_a_file_that_becomes_whole_later_is_found_by_and_by(
    path: Path, watch: Watch, file: StatisticsFile, time: Time
) -> None:
    del file
    whole = path.read_bytes()
    path.write_bytes(b"")
    watch.guard.poll()
    path.write_bytes(whole)
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WAITING, 0)
    time.now += ASK_AGAIN_EVERY
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.WATCHING, 0)


@pytest.fixture
def is_held() -> Iterator[Callable[[], bool]]:
    """True while the guard holds its reserve of memory; it is to be made after this."""
    tracemalloc.start()
    yield lambda: tracemalloc.get_traced_memory()[0] >= SIZE
    tracemalloc.stop()


def test_memory_held_in_reserve_is_released_for_what_fails_and_taken_again_a_while_later(
    is_held: Callable[[], bool], path: Path, file: StatisticsFile, time: Time
) -> None:
    watch = Watch(path)
    watch.raising["why_unguarded"] = MemoryError()
    watch.guard.poll()
    assert not is_held()
    del watch.raising["why_unguarded"]
    time.now += HOLD_AGAIN_AFTER
    watch.guard.poll()
    assert is_held()
    hang(file)
    watch.failing = ["i2c1 0x40: not acknowledged"]
    watch.guard.poll()
    assert not is_held()
    time.now += HOLD_AGAIN_AFTER - 1
    watch.failing = []
    watch.guard.poll()
    assert not is_held()


# What it meets besides a run that dies ----------------------------------------------------------


def guard_seen_at(path: Path) -> int:
    with STATISTICS.opened(path) as file:
        return memoryview(file.read(8 * GUARD, 8)).cast("q")[0]


def with_header(path: Path, **header: object) -> None:
    """A statistics file that is whole but for what its header says."""
    layout = Layout()
    path.write_bytes(STATISTICS.encode(header, layout.cells) + bytes(8 * layout.cells))


def test_outputs_come_before_every_word(watch: Watch, file: StatisticsFile) -> None:
    watch.guard.poll()
    watch.done.clear()
    hang(file)
    watch.guard.poll()
    assert watch.done == ["off", "log", "record"]


@pytest.mark.parametrize("error", ERRORS, ids=lambda each: type(each).__name__)
@pytest.mark.parametrize("part", ["log", "record", "off", "why_unguarded"])
def test_whatever_is_raised_outputs_are_written_poll_after_poll(
    watch: Watch, file: StatisticsFile, part: str, error: Exception
) -> None:
    watch.raising[part] = error
    watch.guard.poll()
    hang(file)
    for _ in range(3):
        watch.guard.poll()
    assert watch.done.count("off") == 3
    assert watch.guard.phase is Phase.HOLDING
    assert sum("the guard goes on" in each for each in watch.reported) == (part == "why_unguarded")


DAMAGED: dict[str, Any] = {
    "empty": {},
    "no conditions": {"writer": {"pid": 1, "started_ticks": 1, "boot_id": ""}},
    "writer a list": {"writer": [], "conditions": {}},
    "writer without keys": {"writer": {}, "conditions": {}},
    "number too large": {
        "writer": {"pid": 10**30, "started_ticks": 1, "boot_id": ""},
        "conditions": {},
    },
    "number of a group": {
        "writer": {"pid": -1, "started_ticks": 1, "boot_id": ""},
        "conditions": {},
    },
    "number a text": {"writer": {"pid": "1", "started_ticks": 1, "boot_id": ""}, "conditions": {}},
    "conditions a text": {"writer": asdict(this_process()), "conditions": "none"},
}


@pytest.mark.parametrize("header", DAMAGED.values(), ids=DAMAGED)
def test_a_header_that_is_of_no_use_is_logged_once_and_replaced_by_a_new_run(
    path: Path, watch: Watch, header: dict[str, Any]
) -> None:
    with_header(path, **header)
    for _ in range(3):
        watch.guard.poll()
    assert watch.done == ["log"]
    assert "no usable" in str(keep_clear_of_other_runs(path))
    StatisticsFile(Layout(), HEADER, path)
    watch.guard.poll()
    assert watch.guard.phase is Phase.WATCHING


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"FWRTSTAT",
        bytes(100),
        PREFIX.pack(b"FWRTSTAT", STATISTICS.schema, 64, 10**12) + bytes(32),
        PREFIX.pack(b"FWRTSTAT", STATISTICS.schema, 100_032, 100_000) + b"[" * 100_000,
    ],
    ids=["empty", "cut", "zeros", "header longer than the file", "nested too deep"],
)
def test_a_file_of_another_format_is_logged_once(path: Path, watch: Watch, content: bytes) -> None:
    path.write_bytes(content)
    for _ in range(3):
        watch.guard.poll()
    assert watch.done == ["log"]
    assert keep_clear_of_other_runs(path) is not None


def test_a_header_that_would_fill_the_memory_is_not_read(path: Path) -> None:
    size = 1 << 40
    path.write_bytes(PREFIX.pack(b"FWRTSTAT", STATISTICS.schema, size, size - PREFIX.size))
    os.truncate(path, size)
    with pytest.raises(StatisticsFileError, match="a header of"):
        WatchedRun(path)


@pytest.mark.parametrize(
    ("make", "done", "why"),
    [
        (os.mkfifo, ["log"], "no regular file"),
        (Path.mkdir, ["log"], "no regular file"),
        (lambda path: path.symlink_to(path), [], "cannot be read"),
    ],
    ids=["fifo", "directory", "leads nowhere"],
)
def test_what_is_no_file_is_not_waited_for_and_logged_once(
    path: Path, watch: Watch, make: Callable[[Path], None], done: list[str], why: str
) -> None:
    make(path)
    for _ in range(2):
        watch.guard.poll()
    assert watch.done == done
    try:
        refused = str(keep_clear_of_other_runs(path))
    except StatisticsFileError as error:
        refused = str(error)
    assert why in refused


def test_a_run_that_drives_is_watched_on_whatever_takes_the_place_of_its_file(
    path: Path, watch: Watch, other: "subprocess.Popen[bytes]"
) -> None:
    watch.guard.poll()
    whole = path.read_bytes()
    path.unlink()
    path.write_bytes(whole)
    watch.guard.poll()
    path.unlink()
    StatisticsFile(Layout(), HEADER, path).close_section(0)
    watch.guard.poll()
    assert "off" not in watch.done
    other.kill()
    other.wait()
    watch.guard.poll()
    assert watch.done.count("off") == 1
    watch.guard.poll()
    assert watch.guard.phase is Phase.WATCHING
    assert guard_seen_at(path) > 0


def test_a_run_whose_file_was_removed_is_watched_on_and_that_is_said_once(
    path: Path, watch: Watch, file: StatisticsFile
) -> None:
    watch.guard.poll()
    path.unlink()
    for _ in range(3):
        watch.guard.poll()
    assert "off" not in watch.done
    said = [each for each in watch.reported if "is gone" in each]
    assert len(said) == 1
    assert "it is watched as before, and found by no command; SIGTERM ends it" in said[0]
    hang(file)
    watch.guard.poll()
    assert watch.guard.phase is Phase.HOLDING


def test_a_run_whose_file_was_cut_short_is_held_off_for_as_long_as_it_lives(
    path: Path, watch: Watch, other: "subprocess.Popen[bytes]"
) -> None:
    watch.guard.poll()
    os.truncate(path, 0)
    watch.guard.poll()
    path.unlink()
    StatisticsFile(Layout(), HEADER, path).close_section(0)
    watch.guard.poll()
    assert (watch.guard.phase, watch.offs) == (Phase.HOLDING, 2)
    assert guard_seen_at(path) == 0
    other.kill()
    other.wait()
    watch.guard.poll()
    assert guard_seen_at(path) > 0


def test_nothing_but_the_outputs_is_looked_at_while_they_are_held_off(
    watch: Watch, file: StatisticsFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is asked of a run that is not guarded may open lines, and end the guard."""
    monkeypatch.setattr(guard, "ASK_AGAIN_EVERY", 0)
    watch.against = "its outputs are others"
    watch.guard.poll()
    hang(file)
    asked = watch.done.count("why_unguarded")
    for _ in range(3):
        watch.guard.poll()
    assert (watch.offs, watch.done.count("why_unguarded")) == (3, asked)
