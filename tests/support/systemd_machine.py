"""A machine that systemd runs, in a directory, with programs that only note how they are called."""

import os
from pathlib import Path

import pytest

from firmware_runtime.host.installation import target
from tests.support.recorded_programs import RecordedPrograms

PROGRAM = "/usr/bin/env"
"""Any program that is there and not hidden from services."""
TOOLS = ("systemd-sysusers", "systemd-tmpfiles", "udevadm", "userdel", "groupdel")
GUARD, RUN = "firmware-runtime-guard@tachobot.service", "firmware-runtime@tachobot.service"
METRICS = "firmware-runtime-metrics@tachobot.service"
RECORDER = "firmware-runtime-record@tachobot.service"
BRIDGE = "firmware-runtime-bridge@tachobot.service"
ACTIVE = """ActiveState=active
SubState=running
ActiveEnterTimestamp=Sat 2026-11-21 07:15:18 UTC
MainPID=4711
NRestarts=2
WatchdogUSec=2s
Result=success
UnitFileState=enabled
StatusText=100 Hz 99.98 % on time, late 3
"""


class SystemdMachine:
    """Its user is root, every program succeeds, and every unit is active."""

    def __init__(self, directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = directory / "machine"
        for each in ("run/systemd/system", "run/udev", "dev", "etc"):
            (self.root / each).mkdir(parents=True)
        for file in ("run/udev/control", "dev/i2c-1"):
            (self.root / file).touch()
        self.programs = RecordedPrograms(directory / "bin")
        self.programs.add(*TOOLS)
        self.programs.add("systemctl", out=ACTIVE)
        monkeypatch.setenv("PATH", str(self.programs.directory))
        monkeypatch.setattr(target, "THIS_MACHINE", self.root)
        monkeypatch.setattr(os, "geteuid", lambda: 0)

    @property
    def calls(self) -> list[str]:
        """Every call of a program so far."""
        return self.programs.calls

    def path(self, name: str) -> Path:
        """Where a file of this machine really is."""
        return self.root / name.lstrip("/")
