"""`service install` and `service uninstall`, below a root and on a machine that systemd runs."""

import os
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.board import registry
from firmware_runtime.host.installation import target
from tests.support.command import Command
from tests.support.installation_rig import files_below
from tests.support.systemd_machine import (
    BRIDGE,
    GUARD,
    METRICS,
    PROGRAM,
    RECORDER,
    RUN,
    SystemdMachine,
)

UNITS = "etc/systemd/system"
COPY = "etc/firmware-runtime/tachobot.toml"


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SystemdMachine:
    return SystemdMachine(tmp_path, monkeypatch)


def install(command: Command, *words: object) -> Any:  # noqa: ANN401 -- what `command` returns
    return command("service", "install", "tachobot", "--program", PROGRAM, *words)


def test_an_installation_calls_systemd_in_this_order(
    command: Command, machine: SystemdMachine
) -> None:
    ended = install(command)
    nodes = " ".join(
        f"--sysname-match={name}" for name in ("cpu_dma_latency", "i2c-*", "gpiochip*")
    )
    assert (ended.status, ended.error) == (0, "")
    assert machine.calls[:-2] == [
        "systemd-sysusers /etc/sysusers.d/firmware-runtime.conf",
        "systemd-tmpfiles --create /etc/tmpfiles.d/firmware-runtime.conf",
        "udevadm control --reload",
        f"udevadm trigger --settle {nodes}",
        f"systemctl enable --no-reload {GUARD} {RUN}",
        "systemctl daemon-reload",
        f"systemctl start {GUARD}",
        f"systemctl start {RUN}",
    ]
    assert [call.split()[1:3] for call in machine.calls[-2:]] == [["show", RUN], ["show", GUARD]]
    assert f"$ systemctl start {RUN}\n" in ended.out
    assert "100 Hz 99.98 % on time, late 3" in ended.out
    assert machine.path(f"{UNITS}/{RUN}.d/board.conf").is_file()
    assert not machine.path(f"{UNITS}/multi-user.target.wants").exists()


def test_where_no_device_manager_runs_none_is_called(
    command: Command, machine: SystemdMachine
) -> None:
    machine.path("run/udev/control").unlink()
    assert install(command).status == 0
    assert not [call for call in machine.calls if call.startswith("udevadm")]


def test_no_start_only_enables(command: Command, machine: SystemdMachine) -> None:
    assert install(command, "--no-start").status == 0
    assert machine.calls[-2:] == [
        f"systemctl enable --no-reload {GUARD} {RUN}",
        "systemctl daemon-reload",
    ]


def test_a_program_that_fails_is_the_end_and_explained(
    command: Command, machine: SystemdMachine
) -> None:
    machine.programs.add("systemd-tmpfiles", error="Failed to parse\nline 1.\n", status=65)
    ended = install(command)
    assert ended.status == 6
    assert ended.error == (
        "firmware-runtime: systemd-tmpfiles --create /etc/tmpfiles.d/firmware-runtime.conf: ended "
        "with status 65: Failed to parse line 1.\n"
    )
    assert len(machine.calls) == 2


def test_a_missing_bus_is_a_warning(command: Command, machine: SystemdMachine) -> None:
    machine.path("dev/i2c-1").unlink()
    ended = install(command)
    assert ended.status == 0
    assert ended.error == (
        "firmware-runtime: warning: /dev/i2c-1 does not exist; `firmware-runtime doctor tachobot` "
        "says what to do\n"
    )
    assert f"systemctl start {RUN}" in machine.calls


def test_a_running_robot_is_not_restarted_but_named(
    command: Command, machine: SystemdMachine
) -> None:
    assert "takes this up" not in install(command).out
    machine.path(f"{UNITS}/firmware-runtime@.service").write_text("")
    assert f"takes this up at: systemctl restart {GUARD} {RUN}\n" in install(command).out
    assert not [call for call in machine.calls if "restart" in call]


def test_a_dry_run_prints_every_file_and_touches_nothing(
    command: Command, machine: SystemdMachine
) -> None:
    before = files_below(machine.root)
    ended = install(command, "--dry-run")
    assert ended.status == 0
    assert (files_below(machine.root), machine.calls) == (before, [])
    assert install(command).status == 0
    written = [path for path in files_below(machine.root) if path not in before]
    assert len(written) == 13
    for path in map(machine.path, written):
        assert f"### {path}, mode 0644: to be written\n" in ended.out
        assert path.read_text() in ended.out
    shown = [line.removeprefix("$ ") for line in ended.out.splitlines() if line.startswith("$ ")]
    assert [line.replace("'", "") for line in shown] == machine.calls[:8]


def test_a_dry_run_shows_what_is_kept(command: Command, tmp_path: Path) -> None:
    install(command, "--root", tmp_path)
    copy = tmp_path / COPY
    copy.write_text(copy.read_text().replace("kp = 0.75", "kp = 0.5"))
    shown = install(command, "--root", tmp_path, "--dry-run").out
    assert f"### {copy}, mode 0644: is kept: yours differs, as shown below\n" in shown
    assert "    -kp = 0.75\n    +kp = 0.5\n" in shown
    assert shown.count(": is there already\n") == 12
    assert shown.count(" -> /etc/systemd/system/") == 2


def test_a_dry_run_needs_neither_root_nor_systemd(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(target, "THIS_MACHINE", tmp_path)
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    ended = install(command, "--dry-run")
    assert (ended.status, ended.error) == (0, "")
    assert ended.out.count("### ") == 13


@pytest.mark.usefixtures("machine")
def test_a_dry_run_says_that_its_program_would_be_refused(command: Command) -> None:
    ended = command("service", "install", "tachobot", "--dry-run", "--program", "/home/pi/run")
    assert ended.status == 0
    assert "warning: without --dry-run this is refused: /home/pi/run" in ended.error


def test_an_ordinary_user_learns_what_to_do(
    command: Command, machine: SystemdMachine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    before = files_below(machine.root)
    ended = install(command)
    assert ended.status == 2
    assert "expected root: use sudo, or --root DIR to write elsewhere" in ended.error
    assert (files_below(machine.root), machine.calls) == (before, [])


@pytest.mark.parametrize("words", ["install tachobot", "uninstall tachobot", "status"])
def test_without_systemd_nothing_is_done(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    monkeypatch.setattr(target, "THIS_MACHINE", tmp_path)
    error = command.refused("service", *words.split())
    assert "systemd does not run this machine" in error
    assert ("or --root DIR" in error) is (words != "status")  # which has no such option


def test_a_broken_copy_of_the_settings_is_refused_with_its_faults(
    command: Command, tmp_path: Path
) -> None:
    copy = tmp_path / COPY
    copy.parent.mkdir(parents=True)
    copy.write_text('board = "tachobot"\n')
    ended = install(command, "--root", tmp_path)
    assert ended.status == 2
    assert "controller: missing" in ended.error
    assert list(files_below(tmp_path)) == [COPY]


def test_the_users_own_board_file_becomes_the_copy(command: Command, tmp_path: Path) -> None:
    own = tmp_path / "mine.toml"
    shipped = registry.load("tachobot").source.read_text()
    own.write_text(shipped.replace("/dev/i2c-1", "/dev/i2c-3"))
    ended = command("service", "install", own, "--root", tmp_path / "root")
    assert ended.status == 0
    assert (tmp_path / "root" / COPY).read_text() == own.read_text()
    drop_in = tmp_path / "root" / UNITS / f"{RUN}.d" / "board.conf"
    assert "DeviceAllow=/dev/i2c-3 rw" in drop_in.read_text()


def test_removing_stops_the_run_before_its_guard(command: Command, machine: SystemdMachine) -> None:
    install(command)
    machine.path("etc/passwd").write_text("root:x:0:0::/:\nfirmware-runtime:x:999:999::/:\n")
    machine.path("etc/group").write_text("firmware-runtime:x:999:\n")
    before = len(machine.calls)
    ended = command("service", "uninstall", "tachobot", "--purge")
    assert ended.status == 0
    asked = [call for call in machine.calls[before:] if "systemctl show" not in call]
    assert asked == [
        f"systemctl disable --now {RUN}",
        "systemctl disable --now firmware-runtime-ros2@tachobot.service",
        f"systemctl disable --now {BRIDGE}",
        f"systemctl disable --now {METRICS}",
        f"systemctl disable --now {RECORDER}",
        f"systemctl disable --now {GUARD}",
        "systemctl reset-failed firmware-runtime*@tachobot.service",
        "systemctl daemon-reload",
        "udevadm control --reload",
        "userdel firmware-runtime",
        "groupdel firmware-runtime",
    ]
    assert [path for path in files_below(machine.root) if "firmware-runtime" in path] == []
    assert "stays" not in ended.out


def test_a_run_that_did_not_end_safely_keeps_its_guard(
    command: Command, machine: SystemdMachine
) -> None:
    install(command)
    before = files_below(machine.root)
    machine.programs.add("systemctl", out="ActiveState=active\nResult=exit-code\n")
    ended = command("service", "uninstall", "tachobot", "--purge")
    assert ended.status == 6
    assert f"{RUN}: ended with exit-code, so outputs may be on; cut the power" in ended.error
    assert not [call for call in machine.calls if f"disable --now {GUARD}" in call]
    assert files_below(machine.root) == before


def test_what_did_not_run_may_have_failed_before(command: Command, machine: SystemdMachine) -> None:
    install(command)
    machine.programs.add("systemctl", out="ActiveState=failed\nResult=exit-code\n")
    assert command("service", "uninstall", "tachobot").status == 0


def test_without_purge_user_and_settings_stay_and_that_is_said(
    command: Command, machine: SystemdMachine
) -> None:
    install(command)
    ended = command("service", "uninstall", "tachobot")
    assert ended.out.splitlines()[-2:] == [
        f"stays: {machine.path(COPY)}; --purge removes it too",
        "stays: user and group firmware-runtime; --purge removes it too",
    ]
    assert not [call for call in machine.calls if call.startswith("userdel")]
    assert machine.path(COPY).exists()


def test_removing_what_is_not_there_disables_nothing(
    command: Command, machine: SystemdMachine
) -> None:
    assert command("service", "uninstall", "tachobot", "--purge").status == 0
    assert machine.calls == ["systemctl daemon-reload", "udevadm control --reload"]


def test_a_dry_removal_shows_the_way_and_touches_nothing(
    command: Command, machine: SystemdMachine
) -> None:
    install(command)
    before, calls = files_below(machine.root), machine.calls
    ended = command("service", "uninstall", "tachobot", "--purge", "--dry-run")
    assert (files_below(machine.root), machine.calls) == (before, calls)
    assert ended.out.startswith(f"$ systemctl disable --now {RUN}\n")
    assert f"to be removed: {machine.path(COPY)}\n" in ended.out
