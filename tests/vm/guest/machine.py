"""The guest's own tools: commands with a bound, waiting for something to become true."""

import subprocess
from collections.abc import Callable
from pathlib import Path
from select import select
from time import monotonic_ns
from typing import Final

PROGRAM: Final = "/opt/firmware-runtime/venv/bin/firmware-runtime"
PYTHON: Final = "/opt/firmware-runtime/venv/bin/python"
CARRIED: Final = Path("/run/carried")
PATIENCE_S: Final = 180.0
LOOK_S: Final = 0.02


class Failed(Exception):
    """A check found something else than it expected."""


def run(*words: object, timeout_s: float = PATIENCE_S) -> str:
    """Run a command; return what it says on standard output. Raises Failed."""
    done = attempt(*words, timeout_s=timeout_s)
    if done.returncode != 0:
        said = (done.stderr + done.stdout).strip()
        raise Failed(f"`{' '.join(map(str, words))}` ended with {done.returncode}: {said}")
    return done.stdout


def attempt(*words: object, timeout_s: float = PATIENCE_S) -> "subprocess.CompletedProcess[str]":
    """Run a command that may fail. Raises Failed if it does not end."""
    try:
        return subprocess.run(
            [*map(str, words)], capture_output=True, text=True, timeout=timeout_s, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise Failed(f"`{' '.join(map(str, words))}` did not end in {timeout_s:g} s") from error


def wait_until(true: Callable[[], object], what: str, patience_s: float = PATIENCE_S) -> None:
    """Look again and again. Raises Failed when it does not become true in time."""
    give_up_at = monotonic_ns() + int(patience_s * 1e9)
    while not true():
        if monotonic_ns() > give_up_at:
            raise Failed(f"not within {patience_s:g} s: {what}")
        select((), (), (), LOOK_S)


def expect(true: object, otherwise: str) -> None:
    """Raise Failed with this sentence unless something is true."""
    if not true:
        raise Failed(otherwise)


def device_of(board: str) -> Path:
    """The device node of a board's doubles, by the adapter's serial number. Raises Failed."""
    for serial in Path("/sys/devices/platform").glob("vhci_hcd.*/usb*/*/serial"):
        if serial.read_text(encoding="ascii").strip() == f"{board}.i2c1":
            for adapter in serial.parent.glob("*/i2c-*/i2c-dev/i2c-*"):
                return Path("/dev", adapter.name)
    raise Failed(f"no adapter has the serial number {board}.i2c1")
