"""Both robots' settings for the emulated computer; the host's doubles are made of the same."""

import re
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Final

from tests.vm.guest.robot import with_value

UART: Final = "/dev/ttyAMA0"
PATIENT: Final[Mapping[str, object]] = {
    "buses.i2c1.speed_hz": 100_000,
    "executive.max_lag_s": 10.0,
    "executive.max_load_percent": 100.0,
    "executive.watchdog_s": 60.0,
    "arming.max_late_percent": 100.0,
    "guard.stall_s": 10.0,
}
"""Emulated, this computer is slow, and the host's other work is seen here."""
CHANGES: Final[Mapping[str, Mapping[str, object]]] = {
    "tachobot": {  # 20 Hz, and a bearing on which it comes to rest by itself
        "imu.sample_hz": 100,
        "imu.bandwidth_hz": 41,
        "imu.also_accept": [0x70],
        "thrust_pairs.timeout_s": 2.0,
        "controller.period_s": 0.05,
        "controller.compass_time_constant_s": 0.0,
        "world.static_friction_nm": 0.02,
        "world.coulomb_friction_nm": 0.02,
    },
    "detective": {
        "radar_compass.period_s": 0.2,
        "body_compass.period_s": 0.2,
        "mission.faults": 50,
        "mission.on_failure": "wait",
        "world.target": [-0.6, 0.35],
    },
}
SONAR: Final = 'chip = "maxbotix"\nport = "{port}"\nperiod_s = 0.2\nthreshold_m = {threshold_m}'
TABLES: Final[Mapping[str, Mapping[str, str]]] = {
    "tachobot": {},
    "detective": {
        "radar_sonar": SONAR.format(port="uart", threshold_m=4.6) + "\nonly_entering = true",
        "body_sonar": SONAR.format(port="body", threshold_m=0.4),
        "ports.uart": f'device = "{UART}"\nbaud = 9600',
        "ports.body": 'device = "/dev/body"\nbaud = 9600',
    },
}
"""An SRF08 cannot be made of a memory: it is silent while it ranges, and its driver looks."""


def text_of(board: str, timeout_ms: int) -> str:
    """Return a board's settings with this timeout of its bus."""
    package = import_module(f"firmware_boards.{board}")
    text = Path(package.__path__[0], "board.toml").read_text(encoding="utf-8")
    for name, table in TABLES[board].items():
        text = re.sub(rf"(?ms)^\[{name}\].*?\n\n|\Z", f"[{name}]\n{table}\n\n", text, count=1)
    changed = {**PATIENT, **CHANGES[board], "buses.i2c1.timeout_ms": timeout_ms}
    for key, value in changed.items():
        text = with_value(text, key, value)
    return text
