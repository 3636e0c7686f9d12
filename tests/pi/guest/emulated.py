"""What is there on the emulated computer: its bus, its memories, the host."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import Final, TypeVar

from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.wire_errors import HalError
from tests.pi.guest.settings import text_of
from tests.vm.guest.machine import Failed, attempt, run, wait_until
from tests.vm.guest.report import say

BUS: Final = "/dev/i2c-1"
NOTES: Final = "/dev/i2c-2"
NOTE: Final = 0x50
"""Bus and address of what is for the host: it has every byte that is sent there."""
MAY_DRIVE: Final = 0
"""Register of what the watch is told. One of another number begins a piece of a file."""
CARRIED: Final = 1
PIECE: Final = 1000
ATTEMPTS: Final = 20
TRIALS: Final = 5
T = TypeVar("T")
PROGRAM: Final = (sys.executable, "-m", "firmware_runtime.cli")
PATIENCE_S: Final = 240.0
FOLDER: Final = Path("/etc/firmware-runtime")
MINUTES: Final = os.environ.get("ARMED_MINUTES")
TIMEOUT_MS: Final = int(os.environ.get("BUS_TIMEOUT_MS", "1000"))
"""What the host has said to the kernel, for the first process."""
LEDS: Final = range(0x06, 0x46)
FULL_OFF: Final = 0x10
ASKED: Final = "! "
"""How a line begins that asks something of the host."""


def program(*words: object, timeout_s: float = 300.0) -> str:
    """Run the command; return what it says. Raises Failed."""
    return run(*PROGRAM, *words, timeout_s=timeout_s)


def tried(*words: object) -> "subprocess.CompletedProcess[str]":
    """Run the command, which may fail."""
    return attempt(*PROGRAM, *words, timeout_s=300.0)


def tried_in_time(*words: object) -> str:
    """Try a chip, again where it was given up; return what was said of the one that was not.

    A trial has a robot's timeouts, 100 ms on a bus and 20 ms on a port: where others keep the host
    busy, a processor of this computer may stand still for longer. Raises Failed.
    """
    for _ in range(TRIALS):
        done = tried("try", *words)
        if done.returncode == 0:
            return done.stdout
        said = (done.stdout + done.stderr).splitlines()[-1]
        say(f"# {said}")
    raise Failed(f"{TRIALS} trials were given up: {said}")


LOGS: Final = Path("/run/logs")


def started(*words: object, log: str) -> "subprocess.Popen[bytes]":
    """Start a program that goes on."""
    LOGS.mkdir(exist_ok=True)
    with (LOGS / log).open("wb") as file:
        return subprocess.Popen([*map(str, words)], stdout=file, stderr=file)


def log_of(name: str) -> str:
    """What a program that was started has said."""
    return (LOGS / name).read_text(encoding="utf-8", errors="replace")


def waited(true: Callable[[], object], what: str) -> None:
    """Wait until something is true. Raises Failed with the end of each log if it is not in time."""
    try:
        wait_until(true, what, PATIENCE_S)
    except Failed as failed:
        ends = (f"{log.name}: {log_of(log.name)[-700:]}" for log in sorted(LOGS.iterdir()))
        raise Failed("; ".join((str(failed), *ends))) from failed


def ask_host(what: str) -> None:
    """Ask something of the host, which does it at once."""
    say(f"{ASKED}{what}")


def may_drive(*, outputs: bool) -> None:
    """Let the host's watch know whether outputs may be on from now on."""
    with closing(open_i2c("notes", NOTES, timeout_ms=TIMEOUT_MS)) as bus:
        _in_the_end(lambda: bus.write(NOTE, bytes((MAY_DRIVE, outputs))))


def carry(content: bytes) -> None:
    """Send a file to the host, in numbered pieces; the console has what a kernel says in between.

    Of pieces of one number the host keeps the last.
    """
    pieces = [content[first : first + PIECE] for first in range(0, len(content), PIECE)]
    with closing(open_i2c("notes", NOTES, timeout_ms=TIMEOUT_MS)) as bus:
        for number, piece in enumerate(pieces):
            message = bytes((CARRIED, *number.to_bytes(2, "big"), *piece))
            _in_the_end(partial(bus.write, NOTE, message))


def _in_the_end(transfer: Callable[[], T]) -> T:
    """Carry out a transfer of the checks themselves, again where a busy computer is too late."""
    for _ in range(ATTEMPTS - 1):
        with suppress(HalError):
            return transfer()
    return transfer()


def write_settings(board: str) -> Path:
    """Write a board's settings, and let the host make chips of the memories for them."""
    FOLDER.mkdir(exist_ok=True)
    file = FOLDER / f"{board}.toml"
    file.write_text(text_of(board, TIMEOUT_MS), encoding="utf-8")
    ask_host(f"board {board}")
    return file


def memory_of(address: int) -> bytes:
    """What stands in a memory now."""
    with closing(open_i2c("check", BUS, timeout_ms=TIMEOUT_MS)) as bus:
        return _in_the_end(lambda: bus.write_read(address, b"\0", 256))


def are_off(content: Sequence[int]) -> bool:
    """Whether every output of a PCA9685 is full-off, or stands still."""
    asleep = bool(content[0] & 0x10)
    return asleep or all(content[register + 3] & FULL_OFF for register in LEDS[::4])
