"""TachoBot: found, examined, tried chip by chip, driven, and switched off whatever happens."""

import gzip
import json
import math
from pathlib import Path
from typing import Final

from tests.pi.guest.emulated import (
    BUS,
    FOLDER,
    PROGRAM,
    are_off,
    ask_host,
    carry,
    log_of,
    may_drive,
    memory_of,
    program,
    started,
    tried,
    tried_in_time,
    waited,
    write_settings,
)
from tests.pi.guest.robot import Robot
from tests.vm.guest.machine import expect
from tests.vm.guest.report import Check

RECORDING: Final = Path("/run/tachobot.recording")
PWM, IMU = 0x40, 0x68
GRAVITY: Final = 9.80665

robot: Final = Robot("tachobot", FOLDER / "tachobot.toml", lambda: are_off(memory_of(PWM)))


def memories_are_kept_as_the_chips_are() -> str:
    """By the host; what both read after power-up."""
    write_settings("tachobot")
    waited(lambda: memory_of(PWM)[:6].hex() == "1104e2e4e8e0", "0x40 reads as after power-up")
    waited(lambda: memory_of(IMU)[0x75], "0x68 has its WHO_AM_I")
    return f"0x68 has WHO_AM_I {memory_of(IMU)[0x75]:02x}"


def probe_finds_that_tachobot_fits() -> None:
    """By what stands in the memories."""
    shown = program("probe")
    expect("tachobot fits /dev/i2c-1" in shown, shown)


def the_doctor_finds_no_failure() -> None:
    """It names the controller that mishandles a stretched clock."""
    done = tried("doctor", robot.settings, "--json")
    expect(
        done.returncode in {0, 7}, f"status {done.returncode}: {done.stderr}{done.stdout[-500:]}"
    )
    expect("mishandles it" in done.stdout, done.stdout[-500:])


def try_reads_the_inertial_sensor() -> str:
    """Acceleration in SI units; it stands level and still."""
    shown = tried_in_time("mpu9250", "--bus", BUS, "--for", 2, "--json")
    readings = [json.loads(line) for line in shown.splitlines()]
    gravity = math.hypot(*readings[-1]["acceleration_m_s2"])
    expect(abs(gravity - GRAVITY) < 1, f"it weighs {gravity} m/s2")
    return f"{len(readings)} readings, {gravity:.2f} m/s2"


def try_moves_one_output_for_its_time_and_it_reads_back_off() -> str:
    """The third, and no other."""
    may_drive(outputs=True)
    words = ("try", "pca9685", "--bus", BUS, "--channel", 3, "--duty", 0.25, "--for", 5, "--yes")
    trial = started(*PROGRAM, *words, log="trial")
    waited(lambda: _on() == [3], "output 3 is on")
    expect(trial.wait() == 0, log_of("trial"))
    expect(not _on(), f"outputs {_on()} are on")
    may_drive(outputs=False)
    return log_of("trial").splitlines()[-1]


def a_run_is_recorded_and_sent_to_the_host() -> str:
    """10 s, disarmed and at rest; the host replays it."""
    program("run", robot.settings, "--for", "10", "--record", RECORDING, timeout_s=300.0)
    content = gzip.compress(RECORDING.read_bytes())
    carry(content)
    return f"{len(content)} bytes"


def tachobot_drives_nothing_before_it_is_armed() -> None:
    """The guard beside it, at 20 Hz."""
    robot.start()
    expect(robot.is_off(), "an output is on")


def tachobot_is_armed_and_drives() -> None:
    """As soon as nothing speaks against it."""
    robot.arm()
    robot.is_driven()


def a_sensor_that_vanishes_is_a_fault_and_switches_all_off() -> str:
    """Nothing answers at its address any more; no forces come for 2 s."""
    ask_host(f"vanish 0x{IMU:02x}")
    took_ms = robot.switched_off()
    said: list[str] = []

    def is_said() -> bool:
        said.extend(each["last"] for each in robot.faults("imu").values())
        return bool(said)

    waited(is_said, "the fault is among the run's figures")
    return f"off after {took_ms:.0f} ms; {said[-1]}"


def a_sensor_that_comes_back_is_brought_up_and_tachobot_drives_on() -> str:
    """It has lost its supply meanwhile; the run was armed all the time.

    Or its guard was silent for half a second, as where others keep the host busy; then it is armed
    again.
    """
    was_armed = robot.is_armed()
    expect(was_armed or "the guard is gone" in robot.said, f"it is disarmed: {robot.said[-300:]}")
    may_drive(outputs=True)
    ask_host(f"return 0x{IMU:02x}")
    if not was_armed:
        robot.arm()
    robot.is_driven()
    return "it was armed all the time" if was_armed else "it was armed again, its guard was late"


def tachobot_killed_is_switched_off_by_its_guard() -> str:
    """SIGKILL leaves the chips as they were."""
    return robot.kill()


def safe_state_of_tachobot_is_checked_by_reading_back() -> str:
    """With the guard beside it, and no run."""
    return robot.end()


def _on() -> list[int]:
    """The outputs that are not full-off."""
    content = memory_of(PWM)
    return [channel for channel in range(16) if not content[9 + 4 * channel] & 0x10]


CHECKS: Final[tuple[Check, ...]] = (
    memories_are_kept_as_the_chips_are,
    probe_finds_that_tachobot_fits,
    the_doctor_finds_no_failure,
    try_reads_the_inertial_sensor,
    try_moves_one_output_for_its_time_and_it_reads_back_off,
    a_run_is_recorded_and_sent_to_the_host,
    tachobot_drives_nothing_before_it_is_armed,
    tachobot_is_armed_and_drives,
    a_sensor_that_vanishes_is_a_fault_and_switches_all_off,
    a_sensor_that_comes_back_is_brought_up_and_tachobot_drives_on,
    tachobot_killed_is_switched_off_by_its_guard,
    safe_state_of_tachobot_is_checked_by_reading_back,
)
