"""The emulated Raspberry Pi with its card: switched on, logged in to, and cut off.

It is cut off by SIGKILL of QEMU. What the guest has written to its card is in a file of this
computer, and stays; what stood in the guest's memory alone is lost, as with any power cut. What a
card itself may lose that has a cache of its own is not shown by this.
"""

import shlex
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Final

from tests.pi.computer import MONITOR, Monitor, command
from tests.pi.full.image import KIND, USER, Image
from tests.pi.guest.emulated import ASKED
from tests.pi.image import Image as Emulator
from tests.pi.player import Player
from tests.pi.run import PATIENT_MS
from tests.pi.watch import Watch
from tests.support.ssh_target import HOST, SshTarget, free_port
from tests.vm.guest.machine import Failed, attempt, wait_until
from tests.vm.machine import started

LOGIN: Final = f"{USER}@{HOST}"
PATIENCE_S: Final = 600.0
"""Several times what it takes on two cores that are busy."""
LIMIT_S: Final = 10_000.0
CARD: Final = "card"
LAYER: Final = ".layer"
"""How the file of a card is called that has only what differs from another's."""
KERNEL_LINE: Final = (
    "root=/dev/mmcblk0 rw console=ttyS1,115200 loglevel=4 systemd.show_status=no panic=-1 "
    "systemd.condition_needs_update=no "
    "systemd.mask=serial-getty@ttyS1.service systemd.mask=getty@tty1.service "
    "systemd.mask=apt-daily.timer systemd.mask=apt-daily-upgrade.timer"
)


class Computer:
    """One that is on. Its commands are root's, by ssh."""

    def __init__(self, target: SshTarget, watch: Watch, logs: Path) -> None:
        self.target = target
        self.watch = watch
        self._logs = logs
        self._on_since = monotonic()

    @property
    def age_s(self) -> float:
        """Return how long it has been on."""
        return monotonic() - self._on_since

    @property
    def console(self) -> str:
        """Return what its kernel and its journal have said since it was switched on."""
        return (self._logs / "console.log").read_text(encoding="utf-8", errors="replace")

    def attempt(self, shell_command: str, user: str = "root") -> "subprocess.CompletedProcess[str]":
        """Run a shell's command, which may fail."""
        return attempt(*self.target.login(shell_command, user), timeout_s=PATIENCE_S)

    def run(self, shell_command: str, user: str = "root") -> str:
        """Run a shell's command; return what it says. Raises Failed."""
        done = self.attempt(shell_command, user)
        if done.returncode != 0:
            said = (done.stdout + done.stderr).strip()[-1500:]
            raise Failed(f"`{shell_command}` ended with {done.returncode}: {said}")
        return done.stdout

    def write(self, path: str, text: str) -> None:
        """Write a file. Raises Failed."""
        self.run(f"mkdir -p $(dirname {path}) && printf %s {shlex.quote(text)} >{path}")

    def wait(self, true: Callable[[], object], what: str) -> None:
        """Wait until something is true. Raises Failed."""
        wait_until(true, what, PATIENCE_S)

    def wait_for_line(self, words: str) -> None:
        """Wait until its console shows a line with these words. Raises Failed."""
        self.wait(lambda: words in self.console, f"the console shows {words!r}")

    def freeze_card(self, onward: Path) -> None:
        """Keep its card as it is at this instant; what it writes from now on goes elsewhere."""
        Monitor(self._logs / MONITOR).freeze(CARD, onward)

    def outputs(self) -> str:
        """Return in words what was sent since it was switched on. Raises Failed if one was on."""
        line = self.watch.line()
        if not line.startswith("ok "):
            raise Failed(line)
        return line[line.index("(") + 1 : -1]


@contextmanager
def switched_on(
    emulator: Emulator, image: Image, card: Path, logs: Path, *, is_kept: bool
) -> Iterator[Computer]:
    """Boot a card; yields when it can be logged in to, and cuts the power with the block.

    A card that is not kept is left as it was.
    """
    logs.mkdir(parents=True, exist_ok=True)
    target = _target(image, logs)
    kind = "qcow2" if card.suffix == LAYER else "raw"
    drive = f"format={kind},snapshot={'off' if is_kept else 'on'},file={card}"
    with (
        (logs / "console.log").open("w", encoding="utf-8") as log,
        Player(logs, PATIENT_MS) as player,
        started(
            _command(emulator, image, drive, logs, target.port, player.uart_path),
            logs,
            LIMIT_S,
            player.console,
        ) as lines,
    ):

        def listen() -> None:
            with suppress(ValueError):  # cut off, and closed, while a line is waited for
                for line in lines:
                    log.write(f"{line}\n")
                    log.flush()
                    if line.startswith(ASKED):
                        player.ask(line.removeprefix(ASKED))

        Thread(target=listen, daemon=True).start()
        computer = Computer(target, player.watch, logs)
        computer.wait(lambda: computer.attempt("true").returncode == 0, "it can be logged in to")
        yield computer


def _target(image: Image, logs: Path) -> SshTarget:
    """Return where ssh will find it, with the keys that are on its card."""
    target = SshTarget(logs, free_port())
    target.identity = image.key
    target.know(image.root / "etc/ssh/ssh_host_ed25519_key.pub")
    return target


def _command(  # noqa: PLR0917 -- what a computer is made of
    emulator: Emulator, image: Image, drive: str, logs: Path, port: int, uart: str
) -> list[str]:
    """Of what is said twice to QEMU it takes the last."""
    return [
        *command(emulator, KIND, logs, "", uart),
        *("-initrd", str(image.initrd), "-append", KERNEL_LINE),
        *("-drive", f"if=sd,id={CARD},cache=writeback,{drive}"),
        *("-netdev", f"user,id=net,hostfwd=tcp:{HOST}:{port}-:22", "-device", "usb-net,netdev=net"),
        *("-global", "dwc2-usb.usb_version=1"),
    ]
