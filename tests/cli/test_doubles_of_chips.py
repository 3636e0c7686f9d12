"""`doubles serve --chip`, also with `--usbip`: words that are refused, and a server."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.hal.served.client import ServedDoubles
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.wire_errors import NoAcknowledge
from tests.support.waiting import PATIENCE_S


@pytest.mark.parametrize(
    ("words", "what"),
    [
        ([], "neither given"),
        (["tachobot", "--chip", "mpu9250"], "both given"),
        (["--chip", "mpu9250", "--set", "a=1"], "--set"),
        (["--chip", "mpu9520"], "did you mean mpu9250?"),
        (["--chip", "pca9685", "--chip", "h_bridge"], "0x40"),
    ],
)
@pytest.mark.parametrize("action", ["serve", "serve --usbip"])
def test_what_cannot_be_served_is_one_sentence(
    command: Callable[..., Any], tmp_path: Path, action: str, words: list[str], what: str
) -> None:
    ended = command("doubles", *action.split(), *words, "--socket", tmp_path / "doubles")
    assert (ended.status, ended.out) == (2, "")
    assert what in ended.error


def test_a_serial_chip_is_no_adapter(command: Callable[..., Any]) -> None:
    ended = command("doubles", "serve", "--usbip", "--chip", "pca9685", "--chip", "maxbotix")
    assert (ended.status, ended.out) == (2, "")
    assert "ports.maxbotix" in ended.error


@pytest.mark.slow
@pytest.mark.real_time
def test_served_chips_answer_and_fail_as_asked(command: Callable[..., Any], tmp_path: Path) -> None:
    socket = tmp_path / "doubles"
    words = ["doubles", "serve", "--chip", "pca9685@0x41", "--chip", "mpu9250"]
    with subprocess.Popen(
        [sys.executable, "-m", "firmware_runtime.cli", *words, "--socket", str(socket)],
        stdout=subprocess.PIPE,
        text=True,
    ) as server:
        assert server.stdout is not None
        assert "serving chips" in server.stdout.readline()
        connection = Connection(socket, answer_s=PATIENCE_S)
        bus = ServedDoubles(connection.ask, ["i2c1"], []).buses["i2c1"]
        assert bus.write_read(0x41, b"\xfe", 1) == b"\x1e"
        faulty = ("doubles", "fault", "nack", "--socket", socket, "--address", "0x41")
        assert command(*faulty, "--for", 1000).status == 0
        with pytest.raises(NoAcknowledge):
            bus.write_read(0x41, b"\xfe", 1)
        assert bus.write_read(0x68, b"\x75", 1) == b"\x71"
        connection.close()
        server.terminate()
        assert server.wait(PATIENCE_S) == 0
    assert not socket.exists()
