"""Another process that answers for a run that hangs is not believed: outputs may be on."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from firmware_runtime.links.control import ask
from firmware_runtime.links.errors import ControlError
from tests.support.replies import Replies
from tests.support.waiting import PATIENCE_S

IMPOSTOR = """
import os, socket, sys
user = int(sys.argv[1])
with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as own:
    if user != os.getuid():
        os.setgroups([])
        os.setgid(user)
        os.setuid(user)
    print("ready", flush=True)
    while True:
        with open("/proc/net/unix") as table:
            names = {line.split()[-1] for line in table if line.split()[-1].startswith("@")}
        for name in names:
            try:
                own.sendto(b'{"refused": [], "armed": false}', b"\\0" + name[1:].encode())
            except OSError:
                pass
"""


@contextmanager
def impostor(user: int) -> Iterator[None]:
    """A process of a user that answers every socket of this computer without a path."""
    with subprocess.Popen(
        [sys.executable, "-c", IMPOSTOR, str(user)], stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield
        finally:
            process.kill()
            process.wait(PATIENCE_S)


@pytest.mark.slow
@pytest.mark.parametrize("user", [os.getuid(), 65534])
def test_an_answer_that_the_run_did_not_give_is_none(tmp_path: Path, user: int) -> None:
    if user != os.getuid() and os.geteuid() != 0:
        pytest.skip("becoming another user takes root")
    with (
        Replies(tmp_path / "robot.control"),
        impostor(user),
        pytest.raises(ControlError, match="no answer within"),
    ):
        ask(tmp_path / "robot.control", "disarm", timeout_s=1.0)
