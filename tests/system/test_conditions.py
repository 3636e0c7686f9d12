"""The conditions of a run are what the machine shows, and null where it shows nothing."""

import json
from pathlib import Path

from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.system.kernel_files import SystemFiles
from tests.support.fake_machines import pc, raspberry_pi

SHOWN = (
    "clock_source",
    "rt_runtime_us",
    "rt_period_us",
    "model",
    "virtualised",
    "cpus_isolated",
    "cpus_tickless",
    "governor",
    "memory_lock_limit_bytes",
)


def shown(files: SystemFiles) -> dict[str, object]:
    conditions = system_conditions(files)
    return {name: conditions[name] for name in SHOWN}


def test_conditions_of_a_raspberry_pi(tmp_path: Path) -> None:
    assert shown(raspberry_pi(tmp_path).files) == {
        "clock_source": "arch_sys_counter",
        "rt_runtime_us": 950000,
        "rt_period_us": 1000000,
        "model": "Raspberry Pi 4 Model B Rev 1.4",
        "virtualised": False,
        "cpus_isolated": [],
        "cpus_tickless": [],
        "governor": "ondemand",
        "memory_lock_limit_bytes": 8388608,
    }


def test_conditions_of_a_pc_with_isolated_processors(tmp_path: Path) -> None:
    conditions = shown(pc(tmp_path).files)
    assert (conditions["cpus_isolated"], conditions["cpus_tickless"]) == ([2, 3], [3])
    assert (conditions["model"], conditions["virtualised"]) == (None, False)


def test_where_nothing_shows_conditions_are_null(tmp_path: Path) -> None:
    assert shown(SystemFiles(tmp_path)) == dict.fromkeys(SHOWN)


def test_conditions_of_this_machine_can_be_written_as_json() -> None:
    conditions = system_conditions()
    assert json.loads(json.dumps(conditions)) == conditions
    assert set(SHOWN) < set(conditions)
    assert "preemption" in conditions
