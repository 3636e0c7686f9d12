"""What surrounds a run: its files, other runs, the guard; and what is installed."""

import os
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest

from firmware_runtime.host.doctor import installation
from firmware_runtime.host.doctor.check import Severity
from firmware_runtime.statistics.layout import GUARD, HEARTBEAT
from tests.support.fake_machines import TACHOBOT, Examine, container, pc, raspberry_pi
from tests.support.written_run import WrittenRun

MIB = 1 << 20


class Usage(NamedTuple):
    free: int


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    directory = tmp_path / "state"
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(directory))
    return directory


def run_under_way(state: Path) -> WrittenRun:
    state.mkdir()
    return WrittenRun(path=state / "tachobot.stats", board="tachobot")


def test_a_run_under_way_is_shown_with_its_process(
    tmp_path: Path, examine: Examine, state: Path
) -> None:
    machine = container(tmp_path, TACHOBOT)
    assert examine("other-run", machine).status is Severity.OK
    run_under_way(state)
    finding = examine("other-run", machine)
    assert (finding.status, finding.seen) == ("note", f"process {os.getpid()} runs tachobot")
    assert examine("other-run", replace(machine, demands=None)).status is Severity.NOTE
    other = replace(machine, demands=replace(TACHOBOT, board="detective"))
    assert examine("other-run", other).status is Severity.OK


def test_a_run_without_a_guard_is_a_warning(tmp_path: Path, examine: Examine, state: Path) -> None:
    machine = container(tmp_path, TACHOBOT)
    assert examine("guard", machine).status is Severity.NOT_APPLICABLE
    run = run_under_way(state)
    run.cells[HEARTBEAT] = 10**12
    finding = examine("guard", machine)
    assert (finding.status, finding.fix) == ("warning", "firmware-runtime guard tachobot")
    run.cells[GUARD] = 10**12
    assert examine("guard", machine).status is Severity.OK


def test_statistics_of_no_use_are_said_to_be_so(
    tmp_path: Path, examine: Examine, state: Path
) -> None:
    state.mkdir()
    (state / "tachobot.stats").write_bytes(b"something else")
    for check in ("other-run", "guard"):
        assert examine(check, container(tmp_path, TACHOBOT)).status is Severity.NOT_APPLICABLE


def test_a_stated_directory_that_is_closed_is_a_failure(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = container(tmp_path)
    assert examine("statistics-directory", machine).status is Severity.OK
    monkeypatch.setattr(os, "access", lambda *_arguments: False)
    assert examine("statistics-directory", machine).status is Severity.FAILURE


def test_without_a_stated_directory_there_is_the_one_for_temporary_files(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FIRMWARE_RUNTIME_STATE_DIRECTORY")
    monkeypatch.delenv("RUNTIME_DIRECTORY", raising=False)
    temporary = tempfile.gettempdir()
    monkeypatch.setattr(os, "access", lambda path, _mode: str(path) == temporary)
    assert examine("statistics-directory", container(tmp_path)).status is Severity.NOTE
    monkeypatch.setattr(os, "access", lambda *_arguments: False)
    assert examine("statistics-directory", container(tmp_path)).status is Severity.FAILURE


@pytest.mark.parametrize(
    ("free_mib", "status"),
    [
        ((15, 256), "failure"),
        ((256, 15), "failure"),
        ((255, 256), "warning"),
        ((256, 64), "ok"),
        ((256, 63), "warning"),
    ],
)
def test_room_for_files(
    tmp_path: Path,
    examine: Examine,
    monkeypatch: pytest.MonkeyPatch,
    free_mib: tuple[int, int],
    status: str,
) -> None:
    """On the disk for temporary files, and for statistics in memory."""
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", "/run")
    places = (Path(tempfile.gettempdir()), Path("/run"))
    free = {place: Usage(mib * MIB) for place, mib in zip(places, free_mib, strict=True)}
    monkeypatch.setattr(shutil, "disk_usage", free.__getitem__)
    assert examine("disk-space", container(tmp_path)).status == status


def test_the_watchdog_is_shown_with_its_limit(tmp_path: Path, examine: Examine) -> None:
    finding = examine("watchdog-device", raspberry_pi(tmp_path / "pi"))
    assert finding.seen == "watchdog0: Broadcom BCM2835 Watchdog timer, at most 15 s"
    assert examine("watchdog-device", pc(tmp_path / "pc")).status is Severity.NOTE
    hidden = pc(tmp_path / "other", None, {"/dev/watchdog": ""})
    assert examine("watchdog-device", hidden).status is Severity.OK


def test_the_service_manager(tmp_path: Path, examine: Examine) -> None:
    assert examine("systemd", pc(tmp_path / "pc")).status is Severity.OK
    assert examine("systemd", container(tmp_path / "empty")).status is Severity.NOTE


@pytest.mark.parametrize(
    ("release", "status"),
    [
        ((3, 10), "failure"),
        ((3, 11), "ok"),
        ((3, 12), "warning"),
        ((3, 13), "ok"),
        ((3, 14), "ok"),
        ((3, 15), "warning"),
    ],
)
def test_releases_of_python(
    tmp_path: Path,
    examine: Examine,
    monkeypatch: pytest.MonkeyPatch,
    release: tuple[int, int],
    status: str,
) -> None:
    monkeypatch.setattr(sys, "version_info", release)
    assert examine("python-version", container(tmp_path)).status == status


def test_a_missing_package_is_a_failure(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert examine("bus-packages", container(tmp_path)).status is Severity.OK
    monkeypatch.setattr(installation, "_BUS_PACKAGES", ("no-such-distribution",))
    finding = examine("bus-packages", container(tmp_path))
    assert finding.status is Severity.FAILURE
    assert finding.seen.startswith("no-such-distribution missing from ")
