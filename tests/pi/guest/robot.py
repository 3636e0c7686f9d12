"""TachoBot on the real controller: found, examined, driven, and switched off whatever happens."""

import gzip
import signal
import subprocess
import sys
from base64 import b64encode
from pathlib import Path
from time import monotonic_ns
from typing import Final

from tests.pi.guest.emulated import (
    LOGS,
    PROGRAM,
    READY,
    SETTINGS,
    are_off,
    memory_of,
    program,
    started,
    tried,
    waited,
    write_settings,
)
from tests.vm.guest.machine import expect, wait_until
from tests.vm.guest.report import Check, say

RECORDING: Final = Path("/run/tachobot.recording")
CARRIED: Final = "> "
"""How a line of what the host keeps begins, in base64."""
LINE: Final = 1000

_runs: list["subprocess.Popen[bytes]"] = []


def a_puppet_keeps_the_memories_as_the_chips_are() -> str:
    """What both read after power-up."""
    write_settings()
    started(sys.executable, "-m", "tests.pi.guest.puppet", SETTINGS, log="puppet")
    waited(READY.exists, "the puppet looks at the memories")
    found = memory_of(0x40)[:6].hex()
    expect(found == "1104e2e4e8e0", f"0x40 reads {found}")
    return f"0x68 has WHO_AM_I {memory_of(0x68)[0x75]:02x}"


def probe_finds_that_tachobot_fits() -> None:
    """By what stands in the memories."""
    shown = program("probe")
    expect("tachobot fits /dev/i2c-1" in shown, shown)


def the_doctor_finds_no_failure() -> None:
    """It names the controller that mishandles a stretched clock."""
    done = tried("doctor", SETTINGS, "--json")
    expect(
        done.returncode in {0, 7}, f"status {done.returncode}: {done.stderr}{done.stdout[-500:]}"
    )
    expect("mishandles it" in done.stdout, done.stdout[-500:])


def a_run_is_recorded_and_sent_to_the_host() -> str:
    """10 s, disarmed and at rest; the host replays it."""
    program("run", SETTINGS, "--for", "10", "--record", RECORDING, timeout_s=300.0)
    content = gzip.compress(RECORDING.read_bytes())
    text = b64encode(content).decode()
    for first in range(0, len(text), LINE):
        say(f"{CARRIED}{text[first : first + LINE]}")
    return f"{len(content)} bytes"


def nothing_is_driven_before_it_is_armed() -> None:
    """The guard first, then the run, at 20 Hz."""
    started(*PROGRAM, "guard", SETTINGS, log="guard")
    _runs.append(started(*PROGRAM, "run", SETTINGS, "--for", "600", log="run"))
    waited(lambda: tried("stats", "tachobot").returncode == 0, "it runs")
    expect(are_off(memory_of(0x40)), "an output is on")


def it_is_armed_and_drives() -> str:
    """As soon as nothing speaks against it."""
    waited(lambda: tried("arm", "tachobot").returncode == 0, "armed")
    waited(lambda: not are_off(memory_of(0x40)), "an output is on")
    looks, each_ms = READY.read_text().split()
    return f"the puppet has looked {looks} times, {each_ms} ms each"


def killed_it_is_switched_off_by_the_guard() -> str:
    """SIGKILL leaves the chips as they were."""
    _runs[-1].send_signal(signal.SIGKILL)
    since = monotonic_ns()
    waited(lambda: are_off(memory_of(0x40)), "all outputs are off")
    noted = (LOGS / "puppet").read_text().strip() or "nothing"
    return f"seen after {(monotonic_ns() - since) / 1e6:.0f} ms; the puppet noted {noted[-300:]}"


def safe_state_is_checked_by_reading_back() -> str:
    """With the guard beside it, and no run."""
    done = tried("safe-state", SETTINGS)
    expect(done.returncode == 0, done.stderr)
    wait_until(lambda: are_off(memory_of(0x40)), "all outputs are off")
    return done.stdout.strip()


CHECKS: Final[tuple[Check, ...]] = (
    a_puppet_keeps_the_memories_as_the_chips_are,
    probe_finds_that_tachobot_fits,
    the_doctor_finds_no_failure,
    a_run_is_recorded_and_sent_to_the_host,
    nothing_is_driven_before_it_is_armed,
    it_is_armed_and_drives,
    killed_it_is_switched_off_by_the_guard,
    safe_state_is_checked_by_reading_back,
)
