"""The power is cut at steps of an update, and what is there afterwards is looked at.

A step is a command that changes the disk or what runs. Each is noted, and those asked for are held
before they are carried out. Meanwhile the computer stands still as a whole, its card is copied as
it is at that instant, and a second computer is switched on with the copy: what the first had in its
memory alone is lost to it. Then the first goes on, to the end of its update.
"""

import subprocess
from collections.abc import Iterator
from functools import partial
from typing import Final, Self

from tests.pi.full.deploying import MARK, SECOND, second_version
from tests.pi.full.stand import PROGRAM, Robot, Stand
from tests.vm.guest.machine import Failed, expect
from tests.vm.guest.report import Check

EVERY: Final = 6
"""Of the steps of a switch, each so manieth has its cut."""
HELD: Final = "held before: "
WENT_ON: Final = "went on with: "
OVER: Final = "firmware-runtime-watch.service: Deactivated"
"""What the console shows when a trial has its verdict."""
STEPS: Final = ("ln", "mv", "cp", "sync", "tar", "rm", "mkdir", "systemctl", "systemd-run")
TOOL: Final = f"""\
#!/bin/sh
name=${{0##*/}}
if read -r every first </run/cuts; then
	case $(tr '\\0' ' ' </proc/$PPID/cmdline) in
	*" tachobot yes "* | *" service install "* | *"update.sh watch "*)
		echo "$name $*" >>/run/steps
		number=$(wc -l </run/steps)
		if [ $(((number - first) % every)) -eq 0 ]; then
			echo "<2>{HELD}$number $name $*" >/dev/kmsg
			sleep 5
			echo "<2>{WENT_ON}$number" >/dev/kmsg
		fi
		;;
	esac
fi 2>/dev/null
exec "/usr/bin/$name" "$@"
"""
"""Stands before the system's own where the shell looks first; without /run/cuts it does nothing."""
LOOK: Final = f"""\
cd {PROGRAM}/venv/ || exit
cat manifest manifest.made 2>/dev/null | sha256sum --check --strict --quiet && echo whole
grep -q '{MARK}' /etc/systemd/system/firmware-runtime@.service && echo unit
grep -q '{MARK}' /etc/firmware-runtime/tachobot.toml && echo settings
:
"""
"""Prints whether the version in use is whole, and what the second has marked."""
BEFORE_THE_SWITCH: Final = (("send it", 3), ("compare what arrived", 10))
"""Steps of `deploy`, and after how many seconds of each the power is cut."""


def cuts(first: int, stand: Stand) -> Iterator[tuple[str, Check]]:
    """Yield each cut with its name: from this step of the switch on, until the update is over."""
    with stand.on("cut", "deployed") as robot, _Update(stand, robot, first) as update:
        if first == 1:
            for step, after_s in BEFORE_THE_SWITCH:
                check = partial(update.is_cut_before_the_switch, step, after_s)
                yield f"cut in {step!r}, {after_s} s on", check
        number = first
        while not update.is_over:
            yield f"cut before step {number}", partial(update.is_cut_at, number)
            number += EVERY
        yield "the update that was not cut is kept", update.is_kept


class _Update:
    """A deployment of the second version; it stands still while a cut is looked at."""

    def __init__(self, stand: Stand, robot: Robot, first: int) -> None:
        self._stand = stand
        self._robot = robot
        self._first = first
        self.is_over = False

    def __enter__(self) -> Self:
        self._robot.wait_until_it_runs()
        computer = self._robot.computer
        computer.write("/usr/local/bin/tar", TOOL)
        others = " ".join(name for name in STEPS if name != "tar")
        computer.run(
            "cd /usr/local/bin && chmod +x tar && "
            f"for each in {others}; do ln -s tar $each; done && sync"
        )
        computer.write("/run/cuts", f"{EVERY} {self._first}\n")
        words = ("--wheel", second_version(self._stand), "--settings", self._stand.settings(MARK))
        command = self._robot.deployment(*words)
        self._deploying = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        return self

    def __exit__(self, *_: object) -> None:
        with self._deploying:
            self._deploying.kill()

    def is_cut_before_the_switch(self, step: str, after_s: int) -> str:
        """Cut while `deploy` sends or prepares."""
        assert self._deploying.stdout is not None
        if not any(line.startswith(step) for line in self._deploying.stdout):
            raise Failed(f"deploy ended before {step!r}")
        try:
            self._deploying.wait(after_s)
        except subprocess.TimeoutExpired:
            return self._cut()
        raise Failed(f"deploy was done before {after_s} s of {step!r} were over")

    def is_cut_at(self, number: int) -> str:
        """Cut before a step of the switch, or of the trial; nothing where there are fewer.

        `deploy` itself may have given up by then: the computer goes on without it.
        """
        console = self._robot.computer
        console.wait(
            lambda: f"{HELD}{number} " in console.console or OVER in console.console,
            f"step {number} is held, or the update over",
        )
        if f"{HELD}{number} " not in console.console:
            self.is_over = True
            return f"it has {number - 1} at most"
        found = self._cut()
        expect(f"{WENT_ON}{number}" not in console.console, "it was not held for long enough")
        said = next(line for line in console.console.splitlines() if f"{HELD}{number} " in line)
        return f"before `{said.partition(f'{HELD}{number} ')[2]}`; {found}"

    def is_kept(self) -> str:
        """Run the second version, with no output on since power-up; cut once more."""
        outputs = self._robot.expect_it_is_at_rest()
        update = self._robot.update()
        expect(update.state == "committed", f"{update.state}: {update.reason}")
        found = self._cut()
        expect(f"then {SECOND}" in found, found)
        return f"{update.reason}; outputs {outputs}; cut after it, {found}"

    def _cut(self) -> str:
        """Switch a copy on; return what was there. Raises Failed, but for one whole version."""
        with self._robot.computer.standing_still(), self._stand.on("after", "cut") as robot:
            outputs = robot.expect_it_is_at_rest()
            update = robot.update()
            version = next(each for each in update.versions if each.place == "in-use")
            found = robot.computer.run(LOOK).split()
            expected = ["whole", *(["unit", "settings"] if version.version == SECOND else [])]
            expect(found == expected, f"of {version.version} there is {found}, not {expected}")
        return f"then {version.version}, {update.state}; outputs {outputs}"
