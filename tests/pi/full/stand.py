"""A robot's computer and its cards: one is copied, switched on, deployed to, and kept or not."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from firmware_runtime.host.deployment.connection import Commands, Connection
from firmware_runtime.host.deployment.update import Update, Version, update_of
from tests.pi.full.computer import LOGIN, Computer, switched_on
from tests.pi.full.image import Image
from tests.pi.guest.settings import text_of
from tests.pi.image import Image as Emulator
from tests.pi.run import PATIENT_MS
from tests.support.ssh_target import HOST
from tests.vm.commands import run
from tests.vm.guest.machine import Failed, attempt, expect
from tests.vm.guest.robot import with_value

PROGRAM: Final = "/opt/firmware-runtime"
RUNTIME: Final = "firmware-runtime@tachobot.service"
GUARD: Final = "firmware-runtime-guard@tachobot.service"
WAIT: Final = f"""\
until systemctl is-active --quiet {RUNTIME} && systemctl is-active --quiet {GUARD} &&
	{PROGRAM}/venv/bin/firmware-runtime stats tachobot --json
do
	sleep 1
done
"""
DEPLOYMENT_S: Final = 3000.0
SLOWER: Final = {
    "executive.bring_up_s": 300.0,
    "controller.period_s": 0.2,
    "overruns.imu.tolerance_us": 50_000.0,
}
"""5 Hz: it runs beside all of a system, and has to bear its period, or no trial says anything."""


def card_in(folder: Path, name: str) -> Path:
    """Return where the card of this name is, or would be."""
    return folder / f"{name}.card"


class Stand(NamedTuple):
    """What a step has to work with."""

    emulator: Emulator
    image: Image
    folder: Path
    wheels: Path
    """The program as it is now, and as it is altered."""

    def card(self, name: str) -> Path:
        """Return where the card of this name is, or would be."""
        return card_in(self.folder, name)

    def copied(self, name: str, copy: str) -> Path:
        """Copy a card; return the copy."""
        run("cp", "--sparse=always", self.card(name), self.card(copy))
        return self.card(copy)

    @contextmanager
    def on(self, name: str, card: Path, *, is_kept: bool = False) -> Iterator["Robot"]:
        """Switch a computer of this name on; cut its power with the block.

        Its card is as it was afterwards, unless it is kept.
        """
        logs = self.folder / "logs" / name
        with switched_on(self.emulator, self.image, card, logs, is_kept=is_kept) as computer:
            yield Robot(computer)

    def settings(self, remark: str) -> Path:
        """Return TachoBot's settings for this computer, with a remark in them."""
        text = text_of("tachobot", PATIENT_MS)
        for key, value in SLOWER.items():
            text = with_value(text, key, value)
        file = self.folder / "tachobot.toml"
        file.write_text(f"# {remark}\n{text}", encoding="utf-8")
        return file


class Robot:
    """TachoBot's computer, while it is on."""

    def __init__(self, computer: Computer) -> None:
        self.computer = computer

    def deployment(self, *words: object) -> list[str]:
        """Return the command line that deploys to it."""
        return self._deploying(LOGIN, "tachobot", *words)

    def _deploying(self, *words: object) -> list[str]:
        program = (sys.executable, "-m", "firmware_runtime.cli", "deploy")
        patience = ("-o", "ServerAliveCountMax=60")  # emulated, it is silent for longer
        return [*map(str, (*program, *words, *self.computer.target.words, *patience))]

    def deploy(self, *words: object) -> "subprocess.CompletedProcess[str]":
        """Deploy to it, which may fail."""
        return attempt(*self.deployment(*words), timeout_s=DEPLOYMENT_S)

    def status(self) -> str:
        """Return what `deploy status` says. Raises Failed."""
        done = attempt(*self._deploying("status", LOGIN))
        expect(done.returncode == 0, f"deploy status: {done.stderr}")
        return done.stdout

    def update(self) -> Update:
        """Return its versions and the state of its last update. Raises DeploymentError."""
        commands = Commands(lambda _: None)
        return update_of(Connection(f"root@{HOST}", self.computer.target.options, commands))

    def version(self) -> Version:
        """Return the version in use. Raises DeploymentError."""
        return next(each for each in self.update().versions if each.place == "in-use")

    def wait_until_it_runs(self) -> dict[str, Any]:
        """Wait for run and guard, in one login; return the statistics. Raises Failed."""
        try:
            shown: dict[str, Any] = json.loads(self.computer.run(WAIT))
        except Failed as failed:
            units = self.computer.run("systemctl --no-pager status 'firmware-runtime*' || :")
            raise Failed(f"{failed}: {units[-3000:]}") from failed
        return shown

    def expect_it_is_at_rest(self) -> str:
        """It runs, is not armed, and no output was on since power-up. Raises Failed."""
        shown = self.wait_until_it_runs()
        expect(shown["conditions"]["run"]["armed"] is False, "it is armed")
        return self.computer.outputs()

    def switch_off(self) -> None:
        """Shut it down in order. Raises Failed."""
        self.computer.attempt("systemctl poweroff")
        self.computer.wait_for_line("reboot: ")
