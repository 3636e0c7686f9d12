"""The detective robot, as far as its chips can be shaped here.

PCA9685, both CMPS12 and the MD25 are memories. An SRF08 cannot be one: it is silent while it
ranges, and its driver looks whether it is. So the sonars are MaxBotix: the radar's on the Pi's own
UART, the body's behind a pseudo-terminal, both with the echoes of the host's arena. At the UART's
other wire is a Sabertooth.
"""

from typing import Final

from tests.pi.guest.emulated import (
    BUS,
    FOLDER,
    are_off,
    may_drive,
    memory_of,
    tried_in_time,
    waited,
    write_settings,
)
from tests.pi.guest.robot import Robot
from tests.pi.guest.settings import UART
from tests.vm.guest.machine import expect
from tests.vm.guest.report import Check

PWM, TREADS, COMPASS = 0x40, 0x58, 0x61
STOP: Final = b"\x80\x80"
robot: Final = Robot(
    "detective",
    FOLDER / "detective.toml",
    lambda: are_off(memory_of(PWM)) and memory_of(TREADS)[:2] == STOP,
)


def memories_are_kept_as_the_detectives_chips_are() -> str:
    """A compass that points somewhere, and treads that stand."""
    write_settings("detective")
    waited(lambda: memory_of(TREADS)[:2] == STOP, "the MD25 reads stop")
    waited(lambda: memory_of(COMPASS)[0], "the CMPS12 has its version")
    return f"0x61 reads {memory_of(COMPASS)[:4].hex(' ')}"


def try_reads_a_compass() -> str:
    """Whose bearing is the head's."""
    words = ("--bus", BUS, "--address", "0x61", "--for", 1, "--json")
    return tried_in_time("cmps12", *words).splitlines()[-1]


def try_turns_a_tread_for_its_time_and_it_reads_back_stopped() -> str:
    """The left one."""
    may_drive(outputs=True)
    said = tried_in_time("md25", "--bus", BUS, "--left", 0.1, "--for", 2, "--yes")
    expect(memory_of(TREADS)[:2] == STOP, "a tread turns")
    may_drive(outputs=False)
    turned = int.from_bytes(memory_of(TREADS)[2:6], "big", signed=True)
    expect(turned > 0, f"its encoder reads {turned}")
    return f"{said.splitlines()[-1]}; its encoder has counted {turned}"


def try_reads_a_sonar_on_the_uart() -> str:
    """What the host's arena has before it, or nothing."""
    shown = tried_in_time("maxbotix", "--port", UART, "--for", 3, "--json")
    return shown.splitlines()[-1]


def try_drives_a_sabertooth_on_the_uart() -> str:
    """Which cannot answer: the host says at the end how it turned."""
    said = tried_in_time("sabertooth", "--port", UART, "--left", 0.2, "--for", 2, "--yes")
    return said.splitlines()[-1]


def the_detective_drives_nothing_before_it_is_armed() -> None:
    """The guard beside it."""
    robot.start()
    expect(robot.is_off(), "an output is on")


def the_detective_is_armed_and_drives_head_and_treads() -> str:
    """The head looks for the target; the treads turn towards it."""
    robot.arm()
    waited(lambda: not are_off(memory_of(PWM)), "the head turns")
    waited(lambda: memory_of(TREADS)[:2] != STOP, "a tread turns")
    return f"treads {memory_of(TREADS)[:2].hex(' ')}; it said {robot.said[-300:]}"


def the_detective_killed_is_switched_off_by_its_guard() -> str:
    """Head and treads."""
    return robot.kill()


def safe_state_of_the_detective_is_checked_by_reading_back() -> str:
    """With the guard beside it, and no run."""
    return robot.end()


CHECKS: Final[tuple[Check, ...]] = (
    memories_are_kept_as_the_detectives_chips_are,
    try_reads_a_compass,
    try_turns_a_tread_for_its_time_and_it_reads_back_stopped,
    try_reads_a_sonar_on_the_uart,
    try_drives_a_sabertooth_on_the_uart,
    the_detective_drives_nothing_before_it_is_armed,
    the_detective_is_armed_and_drives_head_and_treads,
    the_detective_killed_is_switched_off_by_its_guard,
    safe_state_of_the_detective_is_checked_by_reading_back,
)
