"""`make update-test`: bad builds are taken back and equal ones kept, by a real systemd.

`python -m tests.updates.run BAD EQUAL` tries so many of each, all of them where no number is given.
A robot without I2C is deployed to a container, whose chips this process plays; its motors must not
turn in all that time. Exit status 0 if it is as expected, 1 if not, 2 if it cannot be tried here.
"""

import shutil
import subprocess
import sys
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp
from time import monotonic
from typing import Final

from firmware_runtime.errors import DeploymentError, Status
from firmware_runtime.host.deployment.connection import Commands, Connection
from firmware_runtime.host.deployment.update import Update, update_of
from tests.support.ssh_target import HOST
from tests.support.written_package import as_installed
from tests.updates.builds import BAD, Change, write
from tests.updates.chips import Chips, chips
from tests.updates.container import Container, booted, image_in
from tests.vm.commands import Unbuildable, end_in_order, lacking, show
from tests.vm.run import stage
from tests.vm.wheels import make_wheel

HOME: Final = Path(__file__).parents[2] / "build" / "updates"
NEEDED: Final = {
    "systemd-nspawn": "systemd-container",
    "mmdebstrap": "mmdebstrap",
    "ssh": "openssh-client",
    "rsync": "rsync",
}
MAY_BE_FIRST: Final = """
folder='/etc/systemd/system/firmware-runtime@.service.d'
mkdir -p "$folder"
printf '[Service]\\n%s=CAP_SYS_NICE\\n%s=CAP_SYS_NICE\\n' \\
    CapabilityBoundingSet AmbientCapabilities >"$folder/here.conf"
"""
"""A container without CAP_SYS_RESOURCE cannot grant SCHED_FIFO by LimitRTPRIO=."""
IS_ACTIVE: Final = """
for each in $(seq 60); do
    systemctl is-active --quiet firmware-runtime@trolley && exit
    sleep 1
done
exit 1
"""
EQUALS: Final = 20
HEALTH_S: Final = 30


def main() -> int:
    """Try them; each says how it went."""
    end_in_order()
    words = sys.argv[1:]
    if len(words) > 2 or not all(word.isdecimal() for word in words):
        show(f"update-test: {' '.join(words)}; expected how many bad ones, and how many equal")
        return 2
    stated = dict(enumerate(map(int, words)))
    bad, equal = stated.get(0, len(BAD)), stated.get(1, EQUALS)
    if missing := lacking(NEEDED, "update-test", "boots a container"):
        show(f"update-test: {missing}")
        return 2
    folder = Path(mkdtemp(prefix="updates-"))
    try:
        with stage("image"):
            image = image_in(HOME)
        with stage("wheel"):
            wheel = make_wheel(folder)
        with ExitStack() as stack:
            played = stack.enter_context(chips())
            with stage("boot"):
                container = stack.enter_context(booted(image, folder / "machine", played.nodes))
            return Trial(container, played, folder, wheel).carry_out(bad, equal)
    except Unbuildable as error:
        show(f"update-test: {error}")
        return 1
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@dataclass
class Trial:
    """All that is deployed, one after the other, and what became of it."""

    container: Container
    played: Chips
    folder: Path
    wheel: Path
    number: int = 0
    failed: int = 0

    def carry_out(self, bad: int, equal: int) -> int:
        """Deploy a first version, then the others beside it; return the exit status."""
        self.container.run(MAY_BE_FIRST)
        self._expect("committed", "the first version", ())
        if self.failed:
            show("update-test: without a first version there is nothing to try")
            return 1
        for _ in range(equal):
            self._expect("committed", "an equal one", ())
        for what, changes in list(BAD.items())[:bad]:
            self._expect("reverted", what, changes)
        show(f"{self.number - self.failed} as expected, {self.failed} not")
        return min(self.failed, 1)

    def _expect(self, expected: str, what: str, changes: Iterable[Change]) -> None:
        self.number += 1
        began_at = monotonic()
        before = _in_use(self._update())
        status, said = self._deploy(changes)
        took_s = monotonic() - began_at
        update, runs = self._update(), self._runs()
        after, state = _in_use(update), f"{update.state}: {update.reason}"
        if status == Status.BAD_INPUT:
            state = f"refused here: {said}"
        faults = [
            *([] if runs else ["the robot does not run"]),
            *(["a motor has turned"] if self.played.have_turned else []),
        ]
        if expected == "committed":
            faults += [] if status == 0 and after != before else [f"not kept: {said}"]
        else:
            faults += [] if status != 0 and after == before else [f"kept: {said}"]
        self.failed += bool(faults)
        verdict = "FAILED" if faults else "ok"
        show(f"  {verdict} {what}: {state} ({took_s:.0f} s)")
        for fault in faults:
            show(f"    {fault}")

    def _deploy(self, changes: Iterable[Change]) -> tuple[int, str]:
        """Deploy a build with these changes; how it ended, and its last words."""
        source = write(self.folder / f"build-{self.number}", f"1.0.{self.number}", tuple(changes))
        package = as_installed(source, self.folder / f"site-{self.number}")
        target = self.container.ssh
        words = ["deploy", f"root@{HOST}", "trolley", *target.words, "--wheel", str(self.wheel)]
        words += ["--force", "--health", str(HEALTH_S)]
        done = subprocess.run(
            [sys.executable, "-m", "firmware_runtime.cli", *words],
            cwd=source,
            env=package.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        log = self.folder / f"deploy-{self.number}.log"
        log.write_text(done.stdout + done.stderr, encoding="utf-8")
        return done.returncode, " | ".join((done.stdout + done.stderr).splitlines()[-3:])

    def _runs(self) -> bool:
        """Return whether the robot runs, within a minute: the verdict comes before its start."""
        return self.container.run(IS_ACTIVE).returncode == 0

    def _update(self) -> Update:
        """Return how the last update stands; an empty one before the first."""
        target = Connection(f"root@{HOST}", self.container.ssh.options, Commands(lambda _: None))
        try:
            return update_of(target)
        except DeploymentError:
            return Update()


def _in_use(update: Update) -> str | None:
    """Return the folder of the version in use."""
    return next((each.folder for each in update.versions if each.place == "in-use"), None)


if __name__ == "__main__":
    sys.exit(main())
