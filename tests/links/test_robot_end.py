"""A socket that speaks with a run believes those who might have written to the run's as well."""

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.links.ports.robot_end import RobotEnd
from tests.support.replies import Replies
from tests.support.waiting import PATIENCE_S

SAY = """
import os, socket, sys
name, user = b"\\0" + sys.argv[1].encode(), int(sys.argv[2])
with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as other:
    if user != os.getuid():
        os.setgroups([])
        os.setgid(user)
        os.setuid(user)
    other.connect(name)
    socket.send_fds(other, [b"with a descriptor"], [0])
    other.send(b"said")
"""


@pytest.fixture
def end(tmp_path: Path) -> Iterator[RobotEnd]:
    made = RobotEnd(tmp_path / "robot.ports")
    yield made
    made.close()


def say(end: RobotEnd, user: int) -> None:
    """Have a program of a user send to it, once with a descriptor and once without."""
    with socket.socket(fileno=os.dup(end.fileno())) as same:
        name = same.getsockname()[1:].decode()
    words = [sys.executable, "-c", SAY, name, str(user)]
    subprocess.run(words, check=True, stdin=subprocess.DEVNULL, timeout=PATIENCE_S)


def test_what_the_own_user_says_is_taken(end: RobotEnd) -> None:
    say(end, os.getuid())
    assert list(end.received()) == [b"with a descriptor", b"said"]


@pytest.mark.skipif(os.geteuid() != 0, reason="becoming another user takes root")
def test_what_another_user_says_is_dropped_unless_the_run_is_theirs(
    end: RobotEnd, tmp_path: Path
) -> None:
    """Its name is in /proc/net/unix: a reading of a sensor could be made up by anybody."""
    path = tmp_path / "robot.ports"
    with Replies(path):
        say(end, 65534)
        assert list(end.received()) == []
        os.chown(path, 65534, 65534)
        say(end, 65534)
        assert list(end.received()) == [b"with a descriptor", b"said"]
