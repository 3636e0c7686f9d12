"""A process that speaks with a run believes the process that its statistics name, and no other."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from firmware_runtime.links.ports.robot_end import ROOM, OneRunsEnd, RobotEnd
from tests.support.replies import Replies, state_run
from tests.support.waiting import PATIENCE_S, wait_until

LISTEN = """
import os, socket, sys
path, greeting, user = sys.argv[1], sys.argv[2].encode(), int(sys.argv[3])
with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
    listener.bind(path)
    if user != os.getuid():
        os.chmod(path, 0o666)
        os.setgroups([])
        os.setgid(user)
        os.setuid(user)
    listener.listen()
    print("ready", flush=True)
    accepted = []
    while True:
        accepted.append(listener.accept()[0])
        try:
            accepted[-1].send(greeting)
            accepted[-1].send(b'{"refused": [], "armed": false}')
        except OSError:  # whoever it was has gone
            pass
"""
GREETS = '{"greets":"firmware-runtime"}'


@contextmanager
def impostor(path: Path, greeting: str = GREETS, user: int = 0) -> Iterator[None]:
    """Another process that listens at a path, greets as a run does, and says "disarmed"."""
    words = [sys.executable, "-c", LISTEN, str(path), greeting, str(user or os.getuid())]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield
        finally:
            process.kill()
            process.wait(PATIENCE_S)


@pytest.fixture
def statistics(tmp_path: Path) -> Path:
    return tmp_path / "robot.stats"


@pytest.fixture
def end(statistics: Path) -> Iterator[RobotEnd]:
    made = RobotEnd(statistics)
    yield made
    made.close()


def heard(end: RobotEnd) -> list[bytes]:
    """What it says until it is believed, or is known not to be believed."""
    found: list[bytes] = []
    end.connect()

    def is_known() -> bool:
        found.extend(end.received())
        return end.is_greeted or bool(end.why_not_believed)

    wait_until(is_known, "it has greeted")
    return found


def test_what_was_said_before_the_run_greeted_leaves_when_it_has(
    end: RobotEnd, statistics: Path
) -> None:
    with Replies(statistics) as run:
        end.send(b"first")
        assert heard(end) == []
        end.send(b"second")
        assert [run.next()[0], run.next()[0]] == [b"first", b"second"]


def test_so_much_waits_for_the_greeting_and_no_more(end: RobotEnd, statistics: Path) -> None:
    with Replies(statistics):
        for _ in range(ROOM):
            end.send(b"1")
        with pytest.raises(BlockingIOError):
            end.send(b"1")


def test_what_another_process_says_in_the_place_of_the_run_is_not_believed(
    end: RobotEnd, statistics: Path
) -> None:
    state_run(statistics)
    with impostor(end.path):
        assert heard(end) == []
        assert f"the run is process {os.getpid()}" in end.why_not_believed
        assert "the run is process" in end.why_absent()


def test_a_process_that_no_statistics_name_is_not_believed(end: RobotEnd) -> None:
    with impostor(end.path):
        assert heard(end) == []
        assert "no statistics name it" in end.why_not_believed


def test_what_greets_otherwise_is_not_believed(end: RobotEnd, statistics: Path) -> None:
    state_run(statistics)
    with impostor(end.path, "hello"):
        assert heard(end) == []
        assert end.why_not_believed == "greets as no run does"


@pytest.mark.skipif(os.geteuid() != 0, reason="becoming another user takes root")
def test_statistics_of_another_user_make_nothing_a_run(end: RobotEnd, statistics: Path) -> None:
    state_run(statistics)
    os.chown(statistics, 65534, 65534)
    with Replies(statistics):
        os.chown(statistics, 65534, 65534)
        assert heard(end) == []
        assert "robot.stats belongs to " in end.why_not_believed


def test_the_next_run_is_spoken_with_when_the_first_has_gone(
    end: RobotEnd, statistics: Path
) -> None:
    with Replies(statistics):
        heard(end)
    with Replies(statistics) as second:
        end.send(b"1")
        wait_until(lambda: list(end.received()) == [] and end.is_greeted, "it has greeted")
        assert second.next()[0] == b"1"


def test_one_that_is_closed_connects_no_more(end: RobotEnd, statistics: Path) -> None:
    with Replies(statistics):
        end.close()
        with pytest.raises(OSError, match="this end is closed"):
            end.send(b"1")


def test_one_runs_end_speaks_with_no_other(statistics: Path) -> None:
    end = OneRunsEnd(statistics)
    with pytest.raises(FileNotFoundError):
        end.send(b"1")
    with Replies(statistics) as first:
        end.send(b"2")
        heard(end)
        assert first.next()[0] == b"2"
    with Replies(statistics) as second:
        with pytest.raises(ConnectionRefusedError):
            end.send(b"3")
        assert second.requests() == []
    end.close()
