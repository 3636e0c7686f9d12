"""An update, and what is there when the power is cut at steps of it, and after it.

A step is a command that changes the disk or what runs. It is held while QEMU lets the card stay as
it is at that instant, and writes what follows to another file. After the update a computer is
switched on with each card that stayed: what stood in the first one's memory alone is lost to it.
"""

import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

from tests.pi.full.computer import LAYER, Computer
from tests.pi.full.deploying import MARK, SECOND, second_version, steps_in
from tests.pi.full.stand import DEPLOYMENT_S, PROGRAM, Robot, Stand
from tests.vm.guest.machine import expect, wait_until
from tests.vm.guest.report import Check

CHOSEN: Final = (
    "^systemctl stop firmware-runtime@",
    "^systemd-run",
    "^systemctl enable .*firmware-runtime@",
    "^rm -f .*/reserve",
)
"""It is staged; trying; has its settings and units; and its verdict, which is not written yet."""
EACH: Final = (".",)
HELD: Final = "held before: "
WENT_ON: Final = "went on with: "
HOLD_S: Final = 3
OVER: Final = "firmware-runtime-watch.service: Deactivated"
"""What the console shows when a trial has its verdict, and all that follows it is done."""
OOPS: Final = "Internal error: "
"""What the console shows of a kernel that has lost one of its threads, as of the card's driver."""
COMMANDS: Final = ("ln", "mv", "cp", "sync", "rm", "mkdir", "systemctl", "systemd-run")
TOOL: Final = f"""\
#!/bin/sh
name=${{0##*/}}
if [ -e /run/cuts ]; then
	echo "$name $*" >>/run/steps
	number=$(wc -l </run/steps)
	if echo "$name $*" | grep -qE -f /run/cuts; then
		echo "<2>{HELD}$number $name $*" >/dev/kmsg
		sleep {HOLD_S}
		echo "<2>{WENT_ON}$number" >/dev/kmsg
	fi
fi 2>/dev/null
exec "/usr/bin/$name" "$@"
"""
"""Stands before the system's own where a shell looks first; without /run/cuts it does nothing."""
LOOK: Final = f"""\
cd {PROGRAM}/venv/ || exit
cat manifest manifest.made 2>/dev/null | sha256sum --check --strict --quiet && echo whole
grep -q '{MARK}' /etc/systemd/system/firmware-runtime@.service && echo unit
grep -q '{MARK}' /etc/firmware-runtime/tachobot.toml && echo settings
:
"""
"""Prints whether the version in use is whole, and what the second has marked."""


class Cut(NamedTuple):
    """A card as it was when the power was cut."""

    before: str
    """The step that was held."""
    card: Path

    def is_survived(self, stand: Stand) -> str:
        """Switch a computer on with it; return what was there. Raises Failed.

        That is one whole version, with its own unit and settings, and no trial that goes on.
        """
        with stand.on("after", self.card) as robot:
            outputs = robot.expect_it_is_at_rest()
            update = robot.update()
            expect(update.state not in {"staged", "trying"}, f"it is still {update.state}")
            version = next(each for each in update.versions if each.place == "in-use")
            found = robot.computer.run(LOOK).split()
            expected = ["whole", *(["unit", "settings"] if version.version == SECOND else [])]
            expect(found == expected, f"of {version.version} there is {found}, not {expected}")
        return f"then {version.version}, {update.state}: {update.reason}; outputs {outputs}"


def cuts(held: Sequence[str], stand: Stand) -> Iterator[tuple[str, Check]]:
    """Yield an update that is held at steps of these regular expressions, then each cut."""
    update = _Update(held, stand)
    yield "an update that proves itself is committed", update.is_committed
    for cut in update.cuts:
        yield f"the power is cut before `{cut.before}`", partial(cut.is_survived, stand)


class _Update:
    """A deployment of the second version, and the cards that stayed as they were meanwhile."""

    def __init__(self, held: Sequence[str], stand: Stand) -> None:
        self._held = held
        self._stand = stand
        self._card = stand.copied("deployed", "updated")
        self._layers = stand.folder / "layers"
        shutil.rmtree(self._layers, ignore_errors=True)
        self._layers.mkdir()
        self.cuts: list[Cut] = []

    def is_committed(self) -> str:
        """With its own unit; the version before is kept, and no output was on since power-up."""
        with self._stand.on("updated", self._card, is_kept=True) as robot:
            robot.wait_until_it_runs()
            self._be_held(robot.computer)
            printed = self._deployed(robot)
            self._freeze("the next update", robot.computer)
            status = robot.status()
            expect("committed" in status and robot.version().version == SECOND, status)
            outputs = robot.expect_it_is_at_rest()
        steps = "\n".join(cut.before for cut in self.cuts)
        unmet = [each for each in self._held if not re.search(each, steps, re.MULTILINE)]
        expect(not unmet, f"no step is {' or '.join(unmet)}")
        return (
            f"{' | '.join(status.splitlines())}; held {len(self.cuts) - 1} times for {HOLD_S} s: "
            f"{steps_in(printed)}; outputs {outputs}"
        )

    def _be_held(self, computer: Computer) -> None:
        computer.write("/usr/local/bin/mv", TOOL)
        others = " ".join(name for name in COMMANDS if name != "mv")
        computer.run(
            "cd /usr/local/bin && chmod +x mv && "
            f"for each in {others}; do ln -s mv $each; done && sync"
        )
        computer.write("/run/cuts", "".join(f"{each}\n" for each in self._held))

    def _deployed(self, robot: Robot) -> str:
        """Deploy, with cuts where it is held; return what that printed. Raises Failed."""
        stand, computer = self._stand, robot.computer
        words = ("--wheel", second_version(stand), "--settings", stand.settings(MARK))
        log = stand.folder / "logs/updated/deploy.log"
        with log.open("w", encoding="utf-8") as file:
            deploying = subprocess.Popen(
                robot.deployment(*words), stdout=file, stderr=subprocess.STDOUT
            )
        with deploying:
            try:
                wait_until(
                    lambda: self._has_been_held(computer) and deploying.poll() is not None,
                    "deploy ends, and the trial",
                    DEPLOYMENT_S,
                )
            finally:
                deploying.kill()
        return log.read_text(encoding="utf-8")

    def _has_been_held(self, computer: Computer) -> bool:
        """Freeze the card where a step is newly held; return whether the update is over."""
        console = computer.console
        expect(OOPS not in console, "its kernel has failed, as the console shows")
        for number, command in re.findall(rf"{HELD}(\d+) (.*)", console)[len(self.cuts) :]:
            self._freeze(command, computer)
            expect(f"{WENT_ON}{number}\n" not in computer.console, f"{command}: held too shortly")
        return OVER in console

    def _freeze(self, before: str, computer: Computer) -> None:
        onward = self._layers / f"{len(self.cuts)}{LAYER}"
        computer.freeze_card(onward)
        self.cuts.append(Cut(before, self._card))
        self._card = onward
