"""docs/raspberry-pi.md followed word by word: each of its commands is taken from the page itself.

What becomes of each is said below; a test holds the two to the same commands.
"""

import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from functools import partial
from typing import Final, NamedTuple

from tests.pi.full.computer import LOGIN
from tests.pi.full.image import USER
from tests.pi.full.stand import Robot, Stand
from tests.pi.image import fitting
from tests.vm.commands import run
from tests.vm.guest.machine import expect
from tests.vm.guest.report import Check
from tests.vm.wheels import PROJECT, pip

PAGE: Final = PROJECT / "docs/raspberry-pi.md"
COMMAND_S: Final = 2400.0
"""Several times what a command takes: `venv` and pip are the longest."""
PROGRAMS: Final = [
    "echo",
    "sudo",
    "make",
    ".venv/bin/pip",
    "source",
    "firmware-runtime",
    "cp",
    "pkill",
    "for",
]
"""What a line of the page begins with that is a command."""


class Done(NamedTuple):
    """Carried out as it stands, in the project's folder, by the user; and how it ends."""

    status: tuple[int, ...] = (0,)
    says: str = ""
    answer: str = ""
    """What is typed."""
    ctrl_c_s: int = 0
    """After how long the user ends it, if at all."""
    first: tuple[str, ...] = ()
    """Commands of the page that are repeated before."""
    again: bool = False
    """Repeated until it ends so: what speaks against it passes."""
    drives: bool = False
    """Whether outputs are on meanwhile."""
    is_off: bool = True
    """Whether the outputs are off then."""
    then: str = ""
    """What a shell does afterwards, in the reader's place."""


class Beside(NamedTuple):
    """Carried out as it stands, in a terminal of its own where it goes on."""


class Left(NamedTuple):
    """Not carried out, and why."""

    why: str


Row = Done | Beside | Left
INTERRUPTED: Final = 130
NO_CHIP: Final = Left("no such chip on the emulated bus")
ARM: Final = "firmware-runtime arm tachobot"
RUN: Final = "firmware-runtime run my-tachobot.toml"
TABLE: Final[dict[str, Row]] = {
    # 1. The card
    "echo i2c-dev | sudo tee /etc/modules-load.d/i2c-dev.conf": Done(),
    "sudo usermod -aG i2c,gpio,dialout $USER": Done(),
    "sudo apt install git make python3-venv i2c-tools": Done(says="already the newest"),
    "sudo raspi-config nonint do_serial_cons 1": Left("a program of Raspberry Pi OS"),
    "sudo reboot": Left("QEMU ends; and each command is a login of its own, with its new groups"),
    # 2. The program
    "make run": Done(says="tachobot"),
    ".venv/bin/pip install -e '.[gpio,top]'": Done(),
    "source .venv/bin/activate": Done(),
    "firmware-runtime doctor tachobot": Done(status=(0, 7, 8), says="i2c-adapter"),
    # 3. Wiring
    "for byte in 0xA0 0xAA 0xA5 0xE6; do i2cset -y 1 0x70 0 $byte; done": NO_CHIP,
    "for byte in 0xA0 0xAA 0xA5 0xEA; do i2cset -y 1 0x70 0 $byte; done": NO_CHIP,
    "for byte in 0xA0 0xAA 0xA5 0xC2; do i2cset -y 1 0x60 0 $byte; sleep 0.1; done": NO_CHIP,
    "for byte in 0xA0 0xAA 0xA5 0xC4; do i2cset -y 1 0x60 0 $byte; sleep 0.1; done": NO_CHIP,
    # 4. What answers
    "firmware-runtime probe": Done(says="tachobot fits /dev/i2c-1"),
    # 5. One chip at a time
    "firmware-runtime try mpu9250": Done(status=(0, INTERRUPTED), says="m/s2", ctrl_c_s=60),
    "firmware-runtime try pca9685 --channel 0 --duty 0.1": Done(answer="yes", drives=True),
    "firmware-runtime try pca9685 --address 0x41 --channel 0 --pulse-us 1000": NO_CHIP,
    "firmware-runtime try md25 --left 0.1": NO_CHIP,
    "firmware-runtime try h_bridge --pwm 8 --in1 9 --in2 10 --speed 0.3 --for 0.5": Done(
        answer="yes", drives=True
    ),
    # 6. The whole robot
    "cp boards/firmware_boards/tachobot/board.toml my-tachobot.toml": Done(
        then="cp ~/slow.toml my-tachobot.toml"
    ),
    "firmware-runtime check my-tachobot.toml": Done(),
    "firmware-runtime run my-tachobot.toml --doubles": Done(
        status=(0, INTERRUPTED), says="ticks on time", ctrl_c_s=60
    ),
    "firmware-runtime run my-tachobot.toml --for 10": Done(says="ticks on time"),
    "firmware-runtime guard my-tachobot.toml": Beside(),
    RUN: Beside(),
    ARM: Done(again=True, is_off=False),
    "firmware-runtime disarm tachobot": Done(),
    "pkill -KILL -f 'firmware-runtime run'": Done(first=(ARM,)),
    "pkill -STOP -f 'firmware-runtime run'": Done(
        first=(RUN, ARM), then="pkill -CONT -f 'firmware-runtime run'"
    ),
    "firmware-runtime safe-state my-tachobot.toml": Done(
        then="pkill -KILL -f 'firmware-runtime (run|guard)'"
    ),
    # 7. As a service
    "sudo python3 -m venv /opt/firmware-runtime/venv": Done(
        then="sudo install -D ~/slow.toml /etc/firmware-runtime/tachobot.toml"
    ),
    "sudo /opt/firmware-runtime/venv/bin/pip install '.[gpio,top]'": Done(),
    "sudo /opt/firmware-runtime/venv/bin/firmware-runtime service install tachobot --dry-run": (
        Done()
    ),
    "sudo /opt/firmware-runtime/venv/bin/firmware-runtime service install tachobot": Done(),
}


def commands_of(page: str) -> list[str]:
    """Return the page's commands, in order, without the remarks behind them."""
    lines = re.findall(rf"^    ((?:{'|'.join(map(re.escape, PROGRAMS))}) .*)$", page, re.MULTILINE)
    return [re.split(r"\s+#\s", line, maxsplit=1)[0].strip() for line in lines]


def followed(stand: Stand) -> Iterator[tuple[str, Check]]:
    """Yield what becomes of each command; the computer is on all the while."""
    commands = commands_of(PAGE.read_text(encoding="utf-8"))
    with stand.on("followed", stand.card("bare")) as robot:
        visitor = Visitor(stand, robot)
        yield "the project is copied there", visitor.bring
        for command in dict.fromkeys(commands):
            yield f"`{command}`", partial(visitor.follow, command)
        yield "it runs as a service", visitor.runs_as_a_service


def _line(command: str, row: Done) -> str:
    words = command
    if row.ctrl_c_s:
        words = f"timeout --preserve-status --signal=INT {row.ctrl_c_s} {command}"
    elif row.answer:  # at a terminal
        words = f"script --quiet --return --command {shlex.quote(command)} /dev/null"
    return f"{words} <<<'{row.answer}'\n"


class Visitor:
    """The reader of the page, logged in as an ordinary user with sudo."""

    def __init__(self, stand: Stand, robot: Robot) -> None:
        self._stand = stand
        self._robot = robot
        self._session = "cd firmware-runtime || exit\n"

    def bring(self) -> str:
        """Copy the project there, this computer's settings, and what pip would fetch."""
        folder = self._stand.folder / "brought"
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "firmware-runtime").mkdir(parents=True)
        archive = folder / "project.tar"
        run("git", "-C", PROJECT, "archive", "--output", archive, "HEAD")
        run("tar", "-xf", archive, "-C", folder / "firmware-runtime")
        archive.unlink()
        shutil.copy(self._stand.settings("for an emulated computer"), folder / "slow.toml")
        wheel = next(self._stand.wheels.glob("firmware_runtime-*.whl"))
        pip(
            *("download", *fitting(self._stand.image.root), "--find-links", self._stand.wheels),
            *("--dest", folder / "wheels", f"{wheel}[gpio,top]", "setuptools>=77"),
        )
        computer = self._robot.computer
        ssh = shlex.join(("ssh", *computer.target.options))
        run("rsync", "--recursive", "--links", f"--rsh={ssh}", f"{folder}/", f"{LOGIN}:")
        there = f"[global]\nno-index = true\nfind-links = /home/{USER}/wheels\n"
        computer.write("/etc/pip.conf", there)
        limits = f"{USER} - rtprio 60\n{USER} - memlock unlimited\n"
        computer.write("/etc/security/limits.d/firmware-runtime.conf", limits)
        return "pip takes wheels from a folder: there is no network; limits as the doctor says"

    def follow(self, command: str) -> str:
        """Do with a command what the table says. Raises Failed."""
        row = TABLE[command]
        if isinstance(row, Left):
            return f"left out: {row.why}"
        if isinstance(row, Beside):
            self._start(command)
            return "in a terminal of its own"
        for each in row.first:
            self.follow(each)
        if row.drives or not row.is_off:
            self._note(may_drive=True)
        line = _line(command, row)
        if row.again:
            self._robot.computer.wait(lambda: self._typed(line).returncode == 0, f"`{command}`")
        else:
            done = self._typed(line)
            said = done.stdout + done.stderr
            expect(done.returncode in row.status, f"ended with {done.returncode}: {said[-1500:]}")
            expect(row.says in said, said[-1500:])
        on_or_off = "off" if row.is_off else "on"
        self._robot.computer.wait(
            lambda: self._robot.computer.watch.is_off == row.is_off, f"outputs are {on_or_off}"
        )
        if row.is_off:
            self._note(may_drive=False)
        if row.then:
            self._typed(row.then)
        if command.startswith("source "):
            self._session += line
        return f"outputs {on_or_off}"

    def runs_as_a_service(self) -> str:
        """Run and guard, disarmed; no output was on but where a command drives."""
        return f"outputs {self._robot.expect_it_is_at_rest()}"

    def _note(self, *, may_drive: bool) -> None:
        """Let the watch know whether outputs may be on from now on."""
        if self._robot.computer.watch.may_drive != may_drive:
            noted = f"from tests.pi.guest.emulated import may_drive; may_drive(outputs={may_drive})"
            self._robot.computer.run(f'PYTHONPATH=/opt/hand python3 -c "{noted}"')

    def _typed(self, line: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            self._robot.computer.target.login("bash -s", USER),
            input=self._session + line,
            capture_output=True,
            text=True,
            timeout=COMMAND_S,
            check=False,
        )

    def _start(self, command: str) -> None:
        """Leave a terminal to a command; it ends with the computer."""
        words = self._robot.computer.target.login("bash -s >terminal.log 2>&1", USER)
        terminal = subprocess.Popen(words, stdin=subprocess.PIPE, text=True)
        assert terminal.stdin is not None
        terminal.stdin.write(f"{self._session}{command} </dev/null\n")
        terminal.stdin.close()
