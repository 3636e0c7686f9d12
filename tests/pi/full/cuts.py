"""The power is cut at steps of an update, and what is there afterwards is looked at.

A step is a command that changes the disk or what runs. Each is noted, and the one asked for is held
before it is carried out, so that the cut comes exactly there. It is one computer all the while:
what a cut leaves is what the next update begins with.
"""

import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Final, Self

from tests.pi.full.deploying import MARK, SECOND, second_version
from tests.pi.full.stand import PROGRAM, Robot, Stand
from tests.vm.guest.machine import Failed, expect
from tests.vm.guest.report import Check

STEPS: Final = ("ln", "mv", "cp", "sync", "tar", "rm", "mkdir", "systemctl", "systemd-run")
TOOL: Final = """\
#!/bin/sh
name=${0##*/}
if [ -e /run/cut ]; then
	case $(tr '\\0' ' ' </proc/$PPID/cmdline) in
	*" tachobot yes "* | *" service install "* | *"update.sh watch "*)
		echo "$name $*" >>/run/steps
		if [ "$(wc -l </run/steps)" -eq "$(cat /run/cut)" ]; then
			echo "<2>held before: $name $*" >/dev/kmsg
			sleep infinity
		fi
		;;
	esac
fi
exec "/usr/bin/$name" "$@"
"""
"""Stands before the system's own, where the shell looks first; it does nothing without /run/cut."""
LOOK: Final = f"""\
cd {PROGRAM}/venv/ || exit
cat manifest manifest.made 2>/dev/null | sha256sum --check --strict --quiet && echo whole
grep -q '{MARK}' /etc/systemd/system/firmware-runtime@.service && echo unit
grep -q '{MARK}' /etc/firmware-runtime/tachobot.toml && echo settings
:
"""
"""Prints whether the version in use is whole, and what the second has marked."""
HELD: Final = "held before: "
TRIAL_S: Final = 30
EVERY: Final = 3
"""Of the steps of a switch, each so manieth has its cut."""
SCRIPTS: Final = Path(__file__).parents[3] / "firmware_runtime/host/deployment"
SWITCH: Final = ("venvs.sh", "units.sh", "robots.sh", "update.sh", "signatures.sh", "switch.sh")
BEFORE_THE_SWITCH: Final = (("send it", 3), ("compare what arrived", 10))
"""Steps of `deploy`, and after how many seconds of each the power is cut."""


def cuts(stand: Stand) -> Iterator[tuple[str, Check]]:
    """Yield each cut with its name, until an update gets through without one."""
    with _Computer(stand) as computer:
        for step, after_s in BEFORE_THE_SWITCH:
            check = partial(computer.is_cut_before_the_switch, step, after_s)
            yield f"cut in {step!r}, {after_s} s on", check
        yield "cut before the first step of the switch", computer.is_prepared
        number = 1
        while not computer.is_committed:
            number += EVERY
            yield f"cut before step {number}", partial(computer.is_cut_at, number)


class _Computer:
    """One that is cut off again and again."""

    def __init__(self, stand: Stand) -> None:
        self._stand = stand
        self._power = ExitStack()
        self._robot = self._switched_on("deployed")
        self._robot.wait_until_it_runs()
        self._update = self._robot.update()
        self.is_committed = False
        self._new = ""
        """Where the second version is, as it was sent; a copy is kept."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._power.close()

    def _switched_on(self, copied_from: str = "") -> Robot:
        return self._power.enter_context(self._stand.on("cut", copied_from))

    def is_cut_before_the_switch(self, step: str, after_s: int) -> str:
        """Cut while `deploy` sends or prepares."""
        command = self._robot.deployment(*self._second())
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as deploying:
            assert deploying.stdout is not None
            if not any(line.startswith(step) for line in deploying.stdout):
                raise Failed(f"deploy ended before {step!r}")
            try:
                deploying.wait(after_s)
            except subprocess.TimeoutExpired:
                deploying.kill()
            else:
                raise Failed(f"deploy was done before {after_s} s of {step!r} were over")
        return self._cut()

    def is_prepared(self) -> str:
        """Cut before the first step of the switch; keep a copy of the version that was sent."""
        computer = self._robot.computer
        computer.write("/usr/local/bin/tar", TOOL)
        others = " ".join(name for name in STEPS if name != "tar")
        computer.run(
            "cd /usr/local/bin && chmod +x tar && "
            f"for each in {others}; do ln -s tar $each; done && sync"
        )
        computer.write("/run/cut", "1")
        command = self._robot.deployment(*self._second())
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as deploying:
            computer.wait_for_line(HELD)
            deploying.kill()
        found = self._cut()
        (new,) = (each for each in self._update.versions if each.version == SECOND)
        self._new = f"{PROGRAM}/{new.folder}"
        self._robot.computer.run(f"cp -al {self._new} {PROGRAM}/kept && sync")
        return found

    def is_cut_at(self, number: int) -> str:
        """Cut before a step of the switch, or after the whole of it where it has fewer."""
        computer = self._robot.computer
        renewed = f"rm -rf {self._new} && cp -al {PROGRAM}/kept {self._new} && sync"
        computer.run(f"{renewed} && echo {number} >/run/cut")
        script = "".join((SCRIPTS / name).read_text(encoding="utf-8") for name in SWITCH)
        command = computer.target.login(f"sh -s -- '' {self._new} tachobot yes {TRIAL_S} sent")
        with subprocess.Popen(command, stdin=subprocess.PIPE, text=True) as switching:
            assert switching.stdin is not None
            switching.stdin.write(script)
            switching.stdin.close()
            computer.wait(self._is_held_or_over, f"step {number} is held, or the update over")
            switching.kill()
        return self._cut()

    def _is_held_or_over(self) -> bool:
        if HELD in self._robot.computer.console:
            return True
        update = self._robot.update()
        is_over = update.since != self._update.since and update.state in {"committed", "reverted"}
        expect(not is_over or update.state == "committed", f"taken back uncut: {update.reason}")
        self.is_committed = is_over
        return is_over

    def _second(self) -> tuple[object, ...]:
        settings = self._stand.settings(MARK)
        wheel = second_version(self._stand)
        return ("--wheel", wheel, "--settings", settings, "--health", TRIAL_S)

    def _cut(self) -> str:
        """Cut the power, boot again; return what was there. Raises Failed, but for one version."""
        lines = self._robot.computer.console.splitlines()
        held = [line.partition(HELD)[2] for line in lines if HELD in line]
        before = self._robot.computer.outputs()
        self._power.close()
        self._robot = self._switched_on()
        after = self._robot.expect_it_is_at_rest()
        self._update = self._robot.update()
        version = next(each for each in self._update.versions if each.place == "in-use")
        found = self._robot.computer.run(LOOK).split()
        expected = ["whole", *(["unit", "settings"] if version.version == SECOND else [])]
        expect(found == expected, f"of {version.version} there is {found}, expected {expected}")
        where = f"before `{held[0]}`; " if held else ""
        return (
            f"{where}then {version.version}, {self._update.state}; outputs {before}, then {after}"
        )
