"""Processes: alarms, priority, identity, programs, signals; sentences that never wait."""

import gc
import io
import os
import signal
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path
from select import select
from time import monotonic_ns

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.system import this_process
from firmware_runtime.system.atomic_file import why_not_writable
from firmware_runtime.system.c_library import Alarm
from firmware_runtime.system.messages import Sentences
from firmware_runtime.system.programs import ProgramFailed, answer_of, end_within, run_program
from firmware_runtime.system.signals import exit_on_signals, signals_held
from firmware_runtime.system.this_process import come_first
from tests.support.command import in_python
from tests.support.waiting import PATIENCE_S


def has_rung(alarm: Alarm) -> bool:
    return select([alarm], (), (), 0)[0] == [alarm]


def test_it_rings_and_not_before_its_instant() -> None:
    alarm = Alarm()
    at = monotonic_ns() + 2 * MILLISECOND
    alarm.set(at)
    assert select([alarm], (), (), PATIENCE_S)[0] == [alarm]
    assert monotonic_ns() >= at


def test_an_instant_that_has_passed_rings_at_once() -> None:
    alarm = Alarm()
    alarm.set(1)
    assert select([alarm], (), (), PATIENCE_S)[0] == [alarm]


def test_an_alarm_set_again_has_not_rung() -> None:
    alarm = Alarm()
    alarm.set(1)
    alarm.set(monotonic_ns() + 100 * SECOND)
    assert not has_rung(alarm)


def test_an_alarm_never_set_does_not_ring() -> None:
    assert not has_rung(Alarm())


def test_an_instant_before_the_clock_s_first_is_refused() -> None:
    with pytest.raises(OSError, match="Invalid argument"):
        Alarm().set(-SECOND)


def test_its_descriptor_goes_with_it() -> None:
    descriptor = Alarm().fileno()
    gc.collect()
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(descriptor)


VERB = (
    "import os, sys; from firmware_runtime.cli.main import main; "
    "main(); print(os.sched_getscheduler(0), os.sched_getparam(0).sched_priority)"
)


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="only root may be scheduled first without a limit")
@pytest.mark.parametrize(
    ("verb", "scheduled"), [("safe-state", [os.SCHED_FIFO, 61]), ("check", [os.SCHED_OTHER, 0])]
)
def test_safe_state_comes_before_ordinary_processes_and_no_other_verb_does(
    verb: str, scheduled: list[int]
) -> None:
    ended = in_python(VERB, verb, "nothing", check=True)
    assert [int(word) for word in ended.stdout.split()] == scheduled


def test_the_highest_priority_that_is_allowed_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[int] = []

    def take(_process: int, _policy: int, parameter: os.sched_param) -> None:
        if parameter.sched_priority > 60:
            raise PermissionError(1, "Operation not permitted")
        taken.append(parameter.sched_priority)

    monkeypatch.setattr(os, "sched_setscheduler", take)
    come_first()
    assert taken == [60]


CHILD = """
from time import monotonic_ns
now = monotonic_ns()
from firmware_runtime.system.this_process import started_at
print(now, started_at())
"""
LONGEST_TICK = 10_000_000


def test_a_process_started_before_anything_it_does_and_after_it_was_called_for() -> None:
    called_for = monotonic_ns()
    done = in_python(CHILD, check=True)
    first, started = map(int, done.stdout.split())
    assert called_for - LONGEST_TICK <= started <= first


def test_a_pause_between_the_readings_of_two_clocks_moves_no_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    boot, awake, pause = 10**15, 4 * 10**14, 50_000_000
    readings = iter([awake + pause])
    monkeypatch.setattr(this_process, "clock_gettime_ns", lambda _clock: boot)
    monkeypatch.setattr(this_process, "monotonic_ns", lambda: next(readings, awake))
    monkeypatch.setattr(this_process, "_started_ticks", lambda _pid: 1000)
    monkeypatch.setattr(os, "sysconf", lambda _name: 100)
    assert this_process.started_at() == 10 * 1_000_000_000 - (boot - awake)


def test_what_a_program_left_is_kept() -> None:
    ended = run_program(["sh"], text="echo out; echo first >&2; echo last >&2; exit 3")
    assert (ended.status, ended.out) == (3, "out\n")
    assert (ended.reason, ended.complaint) == ("last", "first last")


def test_a_program_that_says_nothing_is_said_to() -> None:
    ended = run_program(["false"])
    assert ended.reason == "ended with status 1 and said nothing"
    assert ended.complaint == ""


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["no-such-command"], r"no-such-command: cannot be run \(No such file"),
        (["sleep", "60"], r"sleep: no end after 0\.05 s"),
        (["sh", "-c", "echo it hurts >&2; exit 8"], "ended with status 8: it hurts"),
    ],
)
def test_an_answer_that_cannot_be_had_is_a_sentence(words: list[str], why: str) -> None:
    with pytest.raises(ProgramFailed, match=why):
        answer_of(words, timeout_s=0.05 if words[0] == "sleep" else None)


def test_what_does_not_end_in_time_is_killed() -> None:
    with subprocess.Popen(["sleep", "60"]) as process:
        end_within(process, 0.01)
        assert process.returncode == -9


def held(number: signal.Signals, steps: list[str]) -> None:
    before = signal.getsignal(number)
    try:
        with signals_held():
            signal.raise_signal(number)
            steps.append("the block went on")
    finally:
        assert signal.getsignal(number) is before
        steps.append("and was left by the signal")


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_it_is_handled_at_the_end_of_the_block(number: signal.Signals, status: int) -> None:
    steps: list[str] = []
    with exit_on_signals(), pytest.raises(SystemExit) as ended:
        held(number, steps)
    assert (ended.value.code, len(steps)) == (status, 2)


def test_without_a_signal_nothing_happens() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with signals_held():
        assert signal.getsignal(signal.SIGTERM) is not before
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_file_that_is_there_or_can_be_made_is_fine_and_is_not_touched(tmp_path: Path) -> None:
    there, new = tmp_path / "there", tmp_path / "new"
    there.write_text("kept")
    (link := tmp_path / "link").symlink_to(tmp_path / "to-be")
    assert [why_not_writable(each) for each in (there, new, link)] == [None, None, None]
    assert there.read_text() == "kept"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["link", "there"]


def test_what_cannot_be_opened_says_why(tmp_path: Path) -> None:
    (file := tmp_path / "file").touch()
    (astray := tmp_path / "astray").symlink_to(tmp_path / "no" / "x")
    assert why_not_writable(tmp_path) == "it is a folder"
    assert why_not_writable(tmp_path / "no" / "x") == f"there is no folder {tmp_path / 'no'}"
    assert why_not_writable(astray) == f"there is no folder {tmp_path / 'no'}"
    assert why_not_writable(file / "x") == "Not a directory"
    assert why_not_writable(tmp_path / ("x" * 300)) == "File name too long"
    assert why_not_writable(Path("a\0b")) == "a null character in its name"


def test_without_the_right_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (file := tmp_path / "file").touch()
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert why_not_writable(file) == "no right to write it"
    assert why_not_writable(tmp_path / "new") == f"no right to write into {tmp_path}"


class Pipe:
    """Both ends of a pipe that others may have open too."""

    def __init__(self) -> None:
        self.reading, writing = os.pipe()
        self.stream = os.fdopen(writing, "w")

    def fill(self) -> None:
        os.set_blocking(self.stream.fileno(), False)
        try:
            while True:
                os.write(self.stream.fileno(), bytes(4096))
        except BlockingIOError:
            os.set_blocking(self.stream.fileno(), True)

    def empty(self) -> bytes:
        os.set_blocking(self.reading, False)
        found = b""
        try:
            while more := os.read(self.reading, 65536):
                found += more
        except BlockingIOError:
            pass
        return found


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    pipe = Pipe()
    yield pipe
    pipe.stream.close()
    os.close(pipe.reading)


@pytest.fixture(params=["opened once more", "may not be opened"])
def to_pipe(
    request: pytest.FixtureRequest, pipe: Pipe, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Sentences]:
    def refuse(*_: object) -> int:
        raise PermissionError

    if request.param == "may not be opened":
        with monkeypatch.context() as patched:
            patched.setattr(os, "open", refuse)
            made = Sentences(pipe.stream)
    else:
        made = Sentences(pipe.stream)
    yield made
    made.close()


def test_a_pipe_with_room_takes_a_line(pipe: Pipe, to_pipe: Sentences) -> None:
    to_pipe.say("all outputs off")
    assert pipe.empty() == b"all outputs off\n"


def test_a_full_pipe_is_not_waited_for_and_what_is_dropped_is_counted(
    pipe: Pipe, to_pipe: Sentences
) -> None:
    pipe.fill()
    to_pipe.say("one")
    to_pipe.say("two")
    assert to_pipe.dropped == 2
    assert pipe.empty().strip(b"\0") == b""
    to_pipe.say("three")
    assert pipe.empty() == b"(2 dropped: no room for them)\nthree\n"
    assert to_pipe.dropped == 0
    to_pipe.say("four")
    assert pipe.empty() == b"four\n"


def test_the_flags_that_others_share_stay_as_they_are(pipe: Pipe, to_pipe: Sentences) -> None:
    to_pipe.say("one")
    assert os.get_blocking(pipe.stream.fileno())


def test_a_line_that_is_longer_than_the_room_is_finished_before_the_next(pipe: Pipe) -> None:
    made = Sentences(pipe.stream)
    made.say("a" * 100_000)
    first = pipe.empty()
    made.say("b")
    assert 0 < len(first) < 100_000
    assert first + pipe.empty() == b"a" * 100_000 + b"\nb\n"
    made.close()


def test_a_reader_that_has_gone_is_no_error(pipe: Pipe, to_pipe: Sentences) -> None:
    with Path(os.devnull).open() as nowhere:
        os.dup2(nowhere.fileno(), pipe.reading)
    to_pipe.say("one")
    assert to_pipe.dropped == 1


def test_a_socket_whose_other_end_does_not_read_is_not_waited_for() -> None:
    here, there = socket.socketpair()
    with here, there, here.makefile("w") as stream:
        made = Sentences(stream)
        while not made.dropped:
            made.say("x" * 10_000)
        assert here.gettimeout() is None
        made.close()


def test_a_file_takes_everything(tmp_path: Path) -> None:
    with (tmp_path / "log").open("w") as stream:
        Sentences(stream).say("bytes \udc80 that are no text")
    assert (tmp_path / "log").read_text() == "bytes \\udc80 that are no text\n"


def test_a_full_disk_drops() -> None:
    with Path("/dev/full").open("w") as stream:
        made = Sentences(stream)
        made.say("one")
        assert made.dropped == 1
        made.close()


def test_a_stream_in_memory_takes_everything_and_no_stream_nothing() -> None:
    stream = io.StringIO()
    made = Sentences(stream)
    made.say("one")
    assert stream.getvalue() == "one\n"
    made.close()
    made.say("two")
    Sentences(None).say("three")
    assert stream.getvalue() == "one\n"
