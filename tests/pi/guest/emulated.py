"""What is there on the emulated computer: its bus, its memories, a robot's settings for it."""

import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import firmware_boards.tachobot

from firmware_runtime.hal.linux import open_i2c
from tests.vm.guest.machine import Failed, attempt, run, wait_until
from tests.vm.guest.robot import with_value

BUS: Final = "/dev/i2c-1"
PROGRAM: Final = (sys.executable, "-m", "firmware_runtime.cli")
READY: Final = Path("/run/puppet")
PATIENCE_S: Final = 240.0
SETTINGS: Final = Path("/etc/firmware-runtime/tachobot.toml")
CHANGED: Final = {
    "buses.i2c1.speed_hz": 100_000,
    "buses.i2c1.timeout_ms": 1000,
    "imu.sample_hz": 100,
    "imu.bandwidth_hz": 41,
    "imu.also_accept": [0x70],
    "thrust_pairs.timeout_s": 2.0,
    "controller.period_s": 0.05,
    "controller.compass_time_constant_s": 0.0,
    "executive.max_lag_s": 10.0,
    "executive.max_load_percent": 100.0,
    "executive.watchdog_s": 30.0,
    "arming.max_late_percent": 100.0,
    "guard.stall_s": 2.0,
}
"""20 Hz, and patience: emulated, this computer is slow, and the host's other work is seen here."""
LEDS: Final = range(0x06, 0x46)
FULL_OFF: Final = 0x10


def program(*words: object, timeout_s: float = 300.0) -> str:
    """Run the command; return what it says. Raises Failed."""
    return run(*PROGRAM, *words, timeout_s=timeout_s)


def tried(*words: object) -> "subprocess.CompletedProcess[str]":
    """Run the command, which may fail."""
    return attempt(*PROGRAM, *words, timeout_s=300.0)


LOGS: Final = Path("/run/logs")


def started(*words: object, log: str) -> "subprocess.Popen[bytes]":
    """Start a program that goes on."""
    LOGS.mkdir(exist_ok=True)
    with (LOGS / log).open("wb") as file:
        return subprocess.Popen([*map(str, words)], stdout=file, stderr=file)


def waited(true: Callable[[], object], what: str) -> None:
    """Wait until something is true. Raises Failed with the end of each log if it is not in time."""
    try:
        wait_until(true, what, PATIENCE_S)
    except Failed as failed:
        ends = (f"{log.name}: {log.read_text()[-700:]}" for log in sorted(LOGS.iterdir()))
        raise Failed("; ".join((str(failed), *ends))) from failed


def write_settings() -> None:
    """Write TachoBot's settings for this computer."""
    text = Path(firmware_boards.tachobot.__path__[0], "board.toml").read_text(encoding="utf-8")
    for key, value in CHANGED.items():
        text = with_value(text, key, value)
    SETTINGS.parent.mkdir(exist_ok=True)
    SETTINGS.write_text(text, encoding="utf-8")


def memory_of(address: int) -> bytes:
    """What stands in a memory now."""
    bus = open_i2c("check", BUS, timeout_ms=1000)
    try:
        return bus.write_read(address, b"\0", 256)
    finally:
        bus.close()


def are_off(content: Sequence[int]) -> bool:
    """Whether every output of a PCA9685 is full-off, or stands still."""
    asleep = bool(content[0] & 0x10)
    return asleep or all(content[register + 3] & FULL_OFF for register in LEDS[::4])
