"""Whole machines: a Raspberry Pi 4, a PC, and a container in which nothing is shown."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from firmware_runtime.host.doctor import clock, installation, scheduling
from firmware_runtime.host.doctor.check import Check, Demands, Machine, Severity, worst
from firmware_runtime.host.doctor.registry import GROUPS, examine
from tests.support.fake_machines import TACHOBOT, container, lay_out, pc, raspberry_pi

CHECKS = [check for checks in GROUPS.values() for check in checks]


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path / "state"))
    monkeypatch.setattr(installation, "_WHOLE_SUITE", (sys.version_info[:2],))
    monkeypatch.setattr(scheduling, "try_fifo", lambda _priority: 1)
    monkeypatch.setattr(clock, "is_synchronised", lambda: True)


def statuses(machine: Machine) -> dict[str, Severity]:
    return {result.check.id: result.finding.status for result in examine(machine)}


def named(machine: Machine, severity: Severity) -> set[str]:
    return {name for name, status in statuses(machine).items() if status is severity}


def test_a_raspberry_pi_as_it_comes_does_not_satisfy_tachobot(tmp_path: Path) -> None:
    machine = raspberry_pi(tmp_path / "pi", TACHOBOT)
    assert named(machine, Severity.FAILURE) == {
        "realtime-limit",
        "fifo-granted",
        "undervoltage-throttling",
        "memory-lock-limit",
    }
    assert named(machine, Severity.WARNING) == {"governor", "i2c-speed", "gpio-persistence"}


def test_a_raspberry_pi_without_a_board_is_judged_more_mildly(tmp_path: Path) -> None:
    machine = raspberry_pi(tmp_path / "pi")
    assert named(machine, Severity.FAILURE) == {"undervoltage-throttling"}
    assert {"realtime-limit", "fifo-granted", "memory-lock-limit"} <= named(
        machine, Severity.WARNING
    )
    assert {"i2c-clock-stretching", "serial-console"} <= named(machine, Severity.NOTE)


def test_a_pc_lacks_the_bus_of_tachobot(tmp_path: Path) -> None:
    machine = pc(tmp_path / "pc", TACHOBOT)
    assert "i2c-adapter" in named(machine, Severity.FAILURE)
    assert named(machine, Severity.WARNING) == {"clock-source"}
    assert {"preemption-model", "isolated-processors"} <= named(machine, Severity.NOTE)


@pytest.mark.parametrize("demands", [None, TACHOBOT, Demands("nothing")])
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: str(check.id))
def test_where_nothing_is_shown_every_check_still_answers(
    tmp_path: Path, check: Check, demands: Demands | None
) -> None:
    finding = check.examine(container(tmp_path / "empty", demands))
    assert finding.seen
    assert (finding.status is Severity.FAILURE) == (
        demands is TACHOBOT and check.id in {"i2c-adapter", "fifo-granted"}
    )


@pytest.mark.parametrize("lay_out_machine", [raspberry_pi, pc])
def test_contents_of_no_known_form_end_no_check_with_an_error(
    tmp_path: Path, lay_out_machine: Callable[..., Machine]
) -> None:
    machine = lay_out_machine(tmp_path / "odd", replace(TACHOBOT, cpus=[1]))
    for path in (tmp_path / "odd").rglob("*"):
        if path.is_file():
            path.write_bytes(b"\xff\xfe odd\n\n:::\n")
    results = examine(machine)
    assert len(results) == len(CHECKS)
    assert worst([result.finding for result in results]) is Severity.FAILURE


def test_the_checks_change_no_file(tmp_path: Path) -> None:
    root = tmp_path / "pi"
    machine = raspberry_pi(root, TACHOBOT)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    examine(machine)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


def test_a_machine_set_up_well_leaves_nothing_to_fix(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scheduling, "try_fifo", lambda _priority: 0)
    machine = raspberry_pi(tmp_path / "pi", TACHOBOT)
    lay_out(
        tmp_path / "pi",
        {
            "/proc/self/limits": "Max realtime priority  60 60\nMax locked memory  unlimited\n",
            "/sys/bus/i2c/devices/i2c-1/of_node/clock-frequency": (400_000).to_bytes(4, "big"),
            "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor": "performance",
            "/sys/devices/platform/soc/soc:firmware/get_throttled": "0",
            "/sys/module/pinctrl_bcm2835/parameters/persist_gpio_outputs": "N",
        },
    )
    assert named(machine, Severity.FAILURE) | named(machine, Severity.WARNING) == set()
