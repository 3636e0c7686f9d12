"""First contact: `probe` and `try` on real adapters, the kernel between them and the doubles."""

import json
import math
import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from tests.vm.guest.machine import PROGRAM, attempt, device_of, expect, run, wait_until
from tests.vm.guest.report import Check
from tests.vm.guest.service import DETECTIVE, TACHOBOT

PWM, INERTIAL = 0x40, 0x68
OUTPUT: Final = "thrust_pairs.3"
GRAVITY: Final = 9.80665
MOVE: Final = ("try", "pca9685", "--channel", 3, "--duty", 0.25, "--yes")


def probe_shows_every_bus_its_chips_and_the_boards_they_fit() -> str:
    """Both robots' doubles, each on an adapter of its own."""
    document = json.loads(run(PROGRAM, "probe", "--json"))
    buses = {bus["device"]: bus for bus in document["buses"]}
    for board in (TACHOBOT.board, DETECTIVE.board):
        device = str(device_of(board))
        expect("i2c-tiny-usb" in buses[device]["name"], f"{device} is {buses[device]['name']}")
        fit = document["boards"][board]
        expect(fit["fits"], f"{board} lacks {fit['missing']}")
        expect(fit["devices"] == {"i2c1": device}, f"{board} fits {fit['devices']}")
    found = {each["address"]: each for each in buses[str(device_of("tachobot"))]["found"]}
    expect(sorted(found) == [PWM, INERTIAL, 0x70], f"it found {sorted(found)}")
    expect(found[INERTIAL]["certain"], "WHO_AM_I did not decide")
    expect(found[PWM]["chips"] == ["PCA9685"], f"0x40 is {found[PWM]}")
    return "; ".join(each["what"] for each in found.values())


def probe_changes_nothing_in_the_chips() -> None:
    """No output moved, and the PWM chip is as after power-up."""
    expect(TACHOBOT.is_off(), "an output is on")
    expect(DETECTIVE.is_off(), "an output is on")


def probe_names_the_kernel_driver_that_holds_an_address() -> str:
    """The kernel's own `dummy` driver, which needs no module, takes the sensor's address."""
    device = device_of("tachobot")
    with _held(device.name, INERTIAL):
        shown = run(PROGRAM, "probe", device)
        refused = attempt(PROGRAM, "try", "mpu9250", "--bus", device, "--for", 1)
    expect("0x68  held by the kernel's driver dummy, and not asked" in shown, shown)
    expect("tachobot does not fit" in shown, shown)
    expect(refused.returncode == 3, f"try ended with {refused.returncode}: {refused.stderr}")
    expect("0x68  MPU-9250: WHO_AM_I reads 71" in run(PROGRAM, "probe", device), "it stays held")
    return refused.stderr.strip()


def probe_says_why_a_bus_may_not_be_opened() -> str:
    """To a user who is in no group, with the command that changes that."""
    refused = attempt("runuser", "-u", "nobody", "--", PROGRAM, "probe")
    expect(refused.returncode == 3, f"it ended with {refused.returncode}: {refused.stderr}")
    expect("sudo usermod -aG i2c" in refused.stdout, refused.stdout)
    return refused.stdout.splitlines()[1].strip()


def try_reads_nine_axes_in_si_units() -> str:
    """The whole bring-up of sensor and magnetometer, then readings; it stands level and still."""
    words = (PROGRAM, "try", "mpu9250", "--bus", device_of("tachobot"), "--for", 2, "--json")
    readings: list[dict[str, Any]] = [json.loads(line) for line in run(*words).splitlines()]
    expect(len(readings) > 1, f"{len(readings)} readings")
    last = readings[-1]
    gravity = math.hypot(*last["acceleration_m_s2"])
    expect(abs(gravity - GRAVITY) < 1, f"it weighs {gravity} m/s2")
    fields = [reading["field_t"] for reading in readings if reading["field_t"]]
    expect(fields, "no field in any reading")
    field_ut = math.hypot(*fields[-1]) * 1e6
    return f"{len(readings)} readings, {gravity:.2f} m/s2, field {field_ut:.0f} uT"


def try_moves_one_output_and_switches_it_off() -> str:
    """As the double's own log has it."""
    before = len(TACHOBOT.levels(OUTPUT))
    said = run(PROGRAM, *MOVE, "--bus", device_of("tachobot"), "--for", 0.5)
    levels = TACHOBOT.levels(OUTPUT)[before:]
    expect(levels == [0.25, 0.0], f"{OUTPUT} went to {levels}")
    expect(TACHOBOT.is_off(), "another output is on")
    return said.strip().splitlines()[-1]


def try_switches_off_on_a_signal() -> str:
    """SIGTERM, Ctrl-Z and Ctrl-backslash while the output is on."""
    for number in (signal.SIGTERM, signal.SIGTSTP, signal.SIGQUIT):
        words = (PROGRAM, *MOVE, "--bus", device_of("tachobot"), "--for", 60)
        with subprocess.Popen([*map(str, words)], stdout=subprocess.DEVNULL) as trial:
            wait_until(lambda: not TACHOBOT.is_off(), "the output is on")
            os.kill(trial.pid, number)
            status = trial.wait(60)
        expect(status == 143, f"after {number.name} it ended with {status}")
        expect(TACHOBOT.is_off(), f"after {number.name} the output is on")
    return "143 each time, outputs off"


def a_bus_that_the_service_drives_is_left_alone() -> str:
    """Probing shows the other robot's, and says whose this one is; nothing is tried on it."""
    device = device_of("tachobot")
    document = json.loads(run(PROGRAM, "probe", "--json"))
    bus = next(each for each in document["buses"] if each["device"] == str(device))
    expect(not bus["asked"], "it was asked")
    expect("left alone: " in bus["why_not"], bus["why_not"])
    expect(document["boards"]["detective"]["fits"], "the detective's bus was left alone too")
    refused = attempt(PROGRAM, *MOVE, "--bus", device)
    expect(refused.returncode == 3, f"try ended with {refused.returncode}: {refused.stderr}")
    expect("another process" in refused.stderr, refused.stderr)
    return str(bus["why_not"])


@contextmanager
def _held(bus: str, address: int) -> Iterator[None]:
    """Within the block a driver of the kernel's holds an address of a bus."""
    files = Path(f"/sys/bus/i2c/devices/{bus}")
    (files / "new_device").write_text(f"dummy 0x{address:02x}", encoding="ascii")
    try:
        yield
    finally:
        (files / "delete_device").write_text(f"0x{address:02x}", encoding="ascii")


CHECKS: Final[tuple[Check, ...]] = (
    probe_shows_every_bus_its_chips_and_the_boards_they_fit,
    probe_changes_nothing_in_the_chips,
    probe_names_the_kernel_driver_that_holds_an_address,
    probe_says_why_a_bus_may_not_be_opened,
    try_reads_nine_axes_in_si_units,
    try_moves_one_output_and_switches_it_off,
    try_switches_off_on_a_signal,
)
BESIDE_A_RUN: Final[tuple[Check, ...]] = (a_bus_that_the_service_drives_is_left_alone,)
