"""Buses, lines, ports and the clock, one circumstance at a time; and the page of all checks."""

import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from firmware_runtime.board import registry
from firmware_runtime.errors import Status
from firmware_runtime.host.doctor import clock
from firmware_runtime.host.doctor.check import Demands, Severity
from firmware_runtime.host.doctor.registry import GROUPS, demands_of
from firmware_runtime.system.kernel_files import THIS_MACHINE, kernel_log
from tests.support.fake_machines import (
    ADAPTER,
    CLOCK,
    TACHOBOT,
    Examine,
    container,
    lay_out,
    link,
    pc,
    raspberry_pi,
)

OTHER = 2**22 + 1
"""A process number that is not this one's: Linux gives none so large."""
SABERTOOTH = Demands("detective", ports=["/dev/serial0"])


def test_adapters_are_shown_by_name(tmp_path: Path, examine: Examine) -> None:
    finding = examine("i2c-adapter", raspberry_pi(tmp_path, TACHOBOT))
    assert finding.seen == "/dev/i2c-1 (bcm2835 (i2c@7e804000))"


def test_a_missing_bus_is_a_failure_that_lists_what_there_is(
    tmp_path: Path, examine: Examine
) -> None:
    demands = replace(TACHOBOT, bus_hz={"/dev/i2c-7": 400_000})
    finding = examine("i2c-adapter", raspberry_pi(tmp_path, demands))
    assert finding.status is Severity.FAILURE
    assert finding.seen.startswith("/dev/i2c-7 missing; there are: /dev/i2c-1")


def test_an_adapter_without_its_node_wants_a_module(tmp_path: Path, examine: Examine) -> None:
    machine = raspberry_pi(tmp_path, TACHOBOT)
    (tmp_path / "dev/i2c-1").unlink()
    finding = examine("i2c-adapter", machine)
    assert finding.status is Severity.FAILURE
    assert "i2c-dev is not loaded" in finding.seen
    assert (finding.fix or "").startswith("sudo modprobe i2c-dev")


def test_a_bus_slower_than_the_board_counts_on_is_a_warning(
    tmp_path: Path, examine: Examine
) -> None:
    machine = raspberry_pi(tmp_path, TACHOBOT)
    finding = examine("i2c-speed", machine)
    assert "100000 Hz; the board counts on 400000 Hz" in finding.seen
    assert "i2c_arm_baudrate=400000" in (finding.fix or "")
    lay_out(tmp_path, {f"{ADAPTER}/of_node/clock-frequency": (400_000).to_bytes(4, "big")})
    assert examine("i2c-speed", machine).status is Severity.OK


def test_a_stretching_chip_on_an_adapter_that_cannot_is_a_warning(
    tmp_path: Path, examine: Examine
) -> None:
    machine = raspberry_pi(tmp_path, TACHOBOT)
    assert examine("i2c-clock-stretching", machine).status is Severity.NOTE
    stretching = replace(TACHOBOT, stretching={"/dev/i2c-1": ["srf08"]})
    assert "srf08" in examine("i2c-clock-stretching", replace(machine, demands=stretching)).seen
    lay_out(tmp_path, {f"{ADAPTER}/name": "3.i2c\n"})
    assert examine("i2c-clock-stretching", replace(machine, demands=stretching)).status == "ok"


def test_how_long_an_adapter_bears_a_stretched_clock_is_said(
    tmp_path: Path, examine: Examine
) -> None:
    limit = {"/sys/module/i2c_bcm2835/parameters/clk_tout_ms": "35\n"}
    finding = examine("i2c-clock-stretching", raspberry_pi(tmp_path, TACHOBOT, limit))
    assert "gives up after 35 ms (clk_tout_ms)" in finding.seen


KMSG = "3,812,{at},-;i2c_designware 1f00074000.i2c: {said}\n SUBSYSTEM=platform\n"
"""A record of /dev/kmsg, with a line that says more of it."""


@pytest.mark.parametrize(
    "said", ["controller timed out", "i2c_dw_handle_tx_abort: lost arbitration"]
)
def test_faults_that_the_kernel_logged_of_an_adapter_are_counted(
    tmp_path: Path, examine: Examine, said: str
) -> None:
    machine = raspberry_pi(tmp_path, TACHOBOT)
    assert examine("i2c-kernel-log", machine).status is Severity.NOT_APPLICABLE
    lay_out(tmp_path, {"/dev/kmsg": "6,1,0,-;Booting Linux; controller timed out nowhere\n"})
    assert examine("i2c-kernel-log", machine).status is Severity.OK
    logged = "".join(KMSG.format(at=at, said=said) for at in (51_235_804, 52_263_816))
    lay_out(tmp_path, {"/dev/kmsg": logged})
    finding = examine("i2c-kernel-log", machine)
    assert finding.status is Severity.WARNING
    expected = f"2 times since the start, last: i2c_designware 1f00074000.i2c: {said}: "
    assert finding.seen.startswith(expected)


def test_the_kernels_log_is_also_read_from_its_file(tmp_path: Path, examine: Examine) -> None:
    line = "Nov 26 12:00:01 pi kernel: [ 9.1] i2c-bcm2835 3f804000.i2c: i2c transfer timed out\n"
    finding = examine("i2c-kernel-log", raspberry_pi(tmp_path, None, {"/var/log/kern.log": line}))
    assert finding.status is Severity.WARNING


def test_this_kernels_log_is_read_to_its_end() -> None:
    assert kernel_log(THIS_MACHINE) is None or isinstance(kernel_log(THIS_MACHINE), list)


def test_a_binding_of_libgpiod_1_is_no_use_to_an_enable_line(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "gpiod", ModuleType("gpiod"))  # has no request_lines
    assert examine("gpio-library", raspberry_pi(tmp_path)).status is Severity.NOTE
    demands = replace(TACHOBOT, has_enable_line=True)
    finding = examine("gpio-library", raspberry_pi(tmp_path / "wired", demands))
    assert finding.status is Severity.FAILURE
    assert "libgpiod 1" in finding.seen


def test_an_address_of_the_board_held_by_a_kernel_driver_is_a_failure(
    tmp_path: Path, examine: Examine
) -> None:
    machine = raspberry_pi(tmp_path, TACHOBOT)
    assert examine("i2c-address-bound", machine).status is Severity.OK
    lay_out(tmp_path, {"/sys/bus/i2c/drivers/inv-mpu9250-i2c/marker": ""})
    link(tmp_path, "/sys/bus/i2c/devices/1-0068/driver", "../../drivers/inv-mpu9250-i2c")
    finding = examine("i2c-address-bound", machine)
    assert (finding.status, finding.seen) == ("failure", "/dev/i2c-1 0x68: inv-mpu9250-i2c")
    assert (finding.fix or "").startswith("echo 0x68 | sudo tee /sys/bus/i2c/devices/i2c-1/")
    assert examine("i2c-address-bound", replace(machine, demands=None)).status is Severity.NOTE


def test_another_program_on_the_bus_is_named(tmp_path: Path, examine: Examine) -> None:
    machine = raspberry_pi(tmp_path, TACHOBOT)
    assert examine("i2c-holders", machine).status is Severity.OK
    lay_out(tmp_path, {f"/proc/{OTHER}/comm": "i2cdetect\n"})
    link(tmp_path, f"/proc/{OTHER}/fd/3", tmp_path / "dev/i2c-1")
    finding = examine("i2c-holders", machine)
    assert (finding.status, finding.seen) == ("warning", f"/dev/i2c-1: i2cdetect ({OTHER})")
    assert finding.fix == f"kill {OTHER}"


def test_a_node_closed_to_the_user_stops_a_board_only(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = raspberry_pi(tmp_path, TACHOBOT)
    assert examine("i2c-access", machine).status is Severity.OK
    monkeypatch.setattr(os, "access", lambda *_arguments: False)
    assert examine("i2c-access", machine).status is Severity.FAILURE
    assert examine("gpio-access", machine).status is Severity.NOTE
    assert examine("i2c-access", replace(machine, demands=None)).status is Severity.WARNING


@pytest.mark.parametrize(("value", "status"), [("Y", "warning"), ("N", "ok"), ("0", "ok")])
def test_lines_that_outlive_their_program_are_a_warning(
    tmp_path: Path, examine: Examine, value: str, status: str
) -> None:
    path = "/sys/module/pinctrl_bcm2835/parameters/persist_gpio_outputs"
    finding = examine("gpio-persistence", raspberry_pi(tmp_path, None, {path: f"{value}\n"}))
    assert finding.status == status


def test_a_console_on_the_boards_port_is_a_failure(tmp_path: Path, examine: Examine) -> None:
    machine = raspberry_pi(tmp_path, SABERTOOTH)
    assert examine("serial-port", machine).status is Severity.OK
    assert examine("serial-console", machine).status is Severity.FAILURE
    assert examine("serial-console", replace(machine, demands=None)).status is Severity.NOTE
    silent = {"/proc/cmdline": "console=tty1", "/sys/class/tty/console/active": "tty1"}
    lay_out(tmp_path, silent)
    assert examine("serial-console", machine).status is Severity.OK


@pytest.mark.parametrize("by", ["of_node", "firmware_node"])
def test_a_uart_that_firmware_describes_is_a_port(
    tmp_path: Path, examine: Examine, by: str
) -> None:
    nodes = {f"/dev/ttyS{number}": "" for number in range(4)}
    machine = pc(tmp_path, None, {**nodes, f"/sys/class/tty/ttyS1/device/{by}/name": "serial"})
    assert examine("serial-port", machine).seen == "/dev/ttyS1"


def test_a_missing_port_is_a_failure(tmp_path: Path, examine: Examine) -> None:
    finding = examine("serial-port", pc(tmp_path, SABERTOOTH))
    assert (finding.status, finding.seen) == ("failure", "/dev/serial0 missing")


def test_a_slow_clock_source_is_a_warning_that_names_a_better_one(
    tmp_path: Path, examine: Examine
) -> None:
    finding = examine("clock-source", pc(tmp_path))
    assert finding.status is Severity.WARNING
    assert (finding.fix or "").startswith("echo tsc | sudo tee ")
    lay_out(tmp_path, {f"{CLOCK}/current_clocksource": "tsc"})
    assert (
        examine("clock-source", pc(tmp_path, None, {f"{CLOCK}/current_clocksource": "tsc"})).status
        == "ok"
    )


@pytest.mark.parametrize(("answer", "status"), [(True, "ok"), (False, "note")])
def test_the_time_of_day(
    *, tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch, answer: bool, status: str
) -> None:
    monkeypatch.setattr(clock, "is_synchronised", lambda: answer)
    assert examine("wall-clock", container(tmp_path)).status == status


def test_a_kernel_that_does_not_say_whether_the_clock_is_right(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> bool:
        raise OSError(1, "the kernel refuses to say")

    monkeypatch.setattr(clock, "is_synchronised", refuse)
    assert examine("wall-clock", container(tmp_path)).status is Severity.NOT_APPLICABLE


def test_this_kernel_says_whether_its_clock_is_right() -> None:
    assert clock.is_synchronised() in {True, False}


def test_demands_of_tachobot() -> None:
    demands = demands_of(registry.load("tachobot", ["executive.cpus=[3]"]))
    assert demands.bus_hz == {"/dev/i2c-1": 400_000}
    assert sorted(demands.addresses["/dev/i2c-1"]) == [0x40, 0x68]
    assert demands.stretching == {"/dev/i2c-1": []}
    assert (demands.fifo_priority, demands.lock_memory, demands.cpus) == (60, True, (3,))
    assert demands.keep_cpu_awake
    assert not demands.has_enable_line


def test_demands_of_the_detective_name_the_chips_that_may_stretch() -> None:
    demands = demands_of(registry.load("detective"))
    assert sorted(demands.addresses["/dev/i2c-1"]) == [0x40, 0x58, 0x61, 0x62, 0x73, 0x75]
    assert set(demands.stretching["/dev/i2c-1"]) == {"srf08", "cmps12", "md25"}
    assert demands.ports == []


def test_a_chip_with_one_address_only_needs_none_in_the_file() -> None:
    board = registry.load("detective", ["radar_compass.chip='hmc5883l'"])
    assert 0x1E in demands_of(board).addresses["/dev/i2c-1"]


SERVICE = (Path(__file__).parents[2] / "docs" / "service.md").read_text()
PAGE = SERVICE.partition("\n## What the doctor checks\n")[2].partition("\n## ")[0]
CHECKS = [check for checks in GROUPS.values() for check in checks]


def test_the_page_has_every_check_with_why_and_the_fix_in_order() -> None:
    rows = re.findall(r"^### (.*)$|^\| `([a-z0-9-]+)` \| (.*) \| `(.*)` \|$", PAGE, re.MULTILINE)
    expected = [
        row
        for group, checks in GROUPS.items()
        for row in ((group, "", "", ""), *(("", each.id, each.why, each.fix) for each in checks))
    ]
    stated = [(title.lower(), *(each.replace("\\|", "|") for each in row)) for title, *row in rows]
    assert stated == expected


def test_the_page_states_every_status() -> None:
    stated = dict(re.findall(r"^\| `([a-z-]+)` \|.*\| (\d) \|$", PAGE, flags=re.MULTILINE))
    exits = {Severity.WARNING: Status.DOCTOR_WARNS, Severity.FAILURE: Status.DOCTOR_FAILS}
    assert stated == {each: str(int(exits.get(each, Status.OK))) for each in Severity}


def test_there_are_enough_checks_and_each_has_a_name_of_its_own() -> None:
    names = [check.id for check in CHECKS]
    assert len(names) == len(set(names)) >= 20
    assert all(re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name) for name in names)
