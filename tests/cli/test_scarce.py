"""No more descriptors, memory or room: one sentence and a status, never a traceback."""

import errno
import os
import resource
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_runtime.cli import main as module
from firmware_runtime.errors import Status
from tests.support.waiting import PATIENCE_S

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.EMFILE, "", "/dev/null"), "/dev/null: Too many open files; expected a "),
        (OSError(errno.ENOSPC, "", "/srv/x"), "/srv/x: No space left on device; expected room"),
        (MemoryError(), "Cannot allocate memory; expected more"),
        (
            FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/tmp']"),
            "No usable temporary directory found in ['/tmp']; expected one with room",
        ),
    ],
)
def test_what_is_scarce_is_said(
    error: Exception,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(_: object) -> int:
        raise error

    monkeypatch.setattr(module, "_executed", fail)
    assert module.main(["show"]) == Status.MODEL_ERROR
    printed = capsys.readouterr().err
    assert said in printed
    assert len(printed.splitlines()) == 1


@pytest.mark.parametrize("number", [errno.EBADF, errno.ENOENT])
def test_any_other_error_is_not_hidden(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> int:
        raise OSError(number, "a defect")

    monkeypatch.setattr(module, "_executed", fail)
    with pytest.raises(OSError, match="a defect"):
        module.main(["show"])


@pytest.mark.real_time
@pytest.mark.parametrize("limit", [10, 12])
def test_two_ends_without_descriptors_are_one_sentence(limit: int, tmp_path: Path) -> None:
    ended = subprocess.run(
        [*COMMAND, "run", "tachobot", "--stage", "network", "--for", "0.5"],
        env=os.environ | {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(tmp_path)},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit)),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert ended.returncode == Status.MODEL_ERROR
    assert "Traceback" not in ended.stderr
    assert "Too many open files" in ended.stderr


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EDQUOT])
@pytest.mark.parametrize("call", ["os.posix_fallocate", "socket.socket.bind"])
def test_a_state_directory_without_room_is_no_bad_input(
    number: int,
    call: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    owner = os if call.startswith("os.") else FailingSocket
    monkeypatch.setattr(owner, call.rpartition(".")[2], fail)
    monkeypatch.setattr("socket.socket", FailingSocket)
    ended = module.main(["run", "tachobot", "--doubles", "--for", "0.1"])
    assert ended == Status.MODEL_ERROR  # which a service tries again, unlike bad input
    said = capsys.readouterr().err
    assert os.strerror(number) in said
    assert "expected a disk with room that is writable" in said


class FailingSocket(socket.socket):
    """One whose methods can be replaced."""
