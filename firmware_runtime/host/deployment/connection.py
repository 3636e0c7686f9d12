"""The way to a target: the system's own ssh and rsync, with the user's keys and configuration."""

import re
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from firmware_runtime.errors import DeploymentError
from firmware_runtime.system.programs import Ended, ProgramFailed, run_program

TIMEOUT_S = 900.0
"""How long one command may take; installing on a small computer takes minutes."""

Log: TypeAlias = Callable[[str], None]


class Commands:
    """Runs commands one after the other; in a dry run prints them as a shell would take them."""

    def __init__(self, log: Log, *, dry_run: bool = False) -> None:
        self.log = log
        self.dry_run = dry_run

    def run(self, command: Sequence[str], scripts: Sequence[Path] = ()) -> Ended:
        """Run a command to its end, with scripts on its standard input.

        Raises DeploymentError when it is not installed or never ends.
        """
        if self.dry_run:
            return self._say(command, scripts)
        text = "".join(script.read_text() for script in scripts)
        try:
            return run_program(command, text=text, timeout_s=TIMEOUT_S)
        except ProgramFailed as error:
            raise DeploymentError(str(error)) from error

    def demand(self, command: Sequence[str], what: str) -> None:
        """Run a command that has to succeed. Raises DeploymentError with its last line."""
        ended = self.run(command)
        if ended.status != 0:
            raise DeploymentError(ended.reason, where=what)

    def _say(self, command: Sequence[str], scripts: Sequence[Path]) -> Ended:
        before = f"{shlex.join(['cat', *map(str, scripts)])} | " if scripts else ""
        self.log(f"  {before}{shlex.join(command)}")
        return Ended(0, "", "")


_HOST = re.compile(r"([a-z_][a-z0-9_.-]*@)?[a-z0-9_][a-z0-9_.-]*", re.IGNORECASE)
_OPTIONS = (
    "BatchMode=yes",  # no prompt: without a key there is an error
    "ConnectTimeout=10",
    "ServerAliveInterval=5",
    "ServerAliveCountMax=12",  # a computer that is busy, or emulated, is silent for long
    "LogLevel=ERROR",
)
_SCRIPTS = Path(__file__).parent
_OF_SSH = 255
"""What ssh ends with when it is its own failure and not that of the remote command."""


def fault_of_host(host: str) -> str | None:
    """Return why this is no host, if it is none.

    ssh would take one that begins with - for an option.
    """
    if _HOST.fullmatch(host):
        return None
    return f"{host!r}: no host; expected HOST or USER@HOST, and a port as --port"


class Connection:
    """A target that commands are sent to; every call is a login of its own.

    `ssh_options` come before our own, and ssh takes the first that it reads.
    """

    def __init__(self, host: str, ssh_options: Sequence[str], commands: Commands) -> None:
        self.host = host
        self._ssh = ["ssh", *ssh_options, *(f"-o{option}" for option in _OPTIONS)]
        self._commands = commands
        self._become: list[str] = []

    def become_root(self) -> None:
        """From now on commands are run by sudo."""
        self._become = ["sudo", "-n"]

    def script(self, names: Sequence[str], *arguments: str) -> Ended:
        """Run shell scripts of this folder on the target, one behind the other as one program."""
        return self._run(["sh", "-s", "--", *arguments], [_SCRIPTS / name for name in names])

    def command(self, *words: str) -> Ended:
        """Run a program on the target."""
        return self._run(words)

    def send(self, folder: Path, to: str, like: str | None = None) -> None:
        """Make a folder on the target of one here.

        What a folder there that is `like` it has, with the same size and time, is copied there.
        """
        command = ["rsync", "--archive", "--no-owner", "--no-group", "--omit-dir-times"]
        command += ["--chmod=D755,Fu=rwX,Fgo=rX", "--compress", "--mkpath", "--protect-args"]
        command += [f"--rsh={shlex.join(self._ssh)}"]
        if like is not None:
            command += [f"--copy-dest={like}"]
        if self._become:
            command += [f"--rsync-path={shlex.join([*self._become, 'rsync'])}"]
        ended = self._commands.run([*command, f"{folder}/", f"{self.host}:{to}/"])
        if ended.status != 0:
            raise DeploymentError(_of_ssh_or_first(ended), where=self.host)

    def _run(self, words: Sequence[str], scripts: Sequence[Path] = ()) -> Ended:
        # ssh joins what it is given with blanks, and the target's shell takes that apart again.
        remote = shlex.join([*self._become, *words])
        ended = self._commands.run([*self._ssh, "--", self.host, remote], scripts)
        if ended.status == _OF_SSH:
            if ended.error.strip():
                raise DeploymentError(ended.reason, where=self.host)
            raise DeploymentError(
                "the connection broke off", where=self.host, expected="it to run until the end"
            )
        return ended


def _of_ssh_or_first(ended: Ended) -> str:
    """Return what ssh said last, or rsync first: it adds where in its source it gave up."""
    lines = [line.strip() for line in ended.error.splitlines() if line.strip()]
    others = [line for line in lines if not line.startswith("rsync")]
    return (others[-1:] or lines[:1] or [ended.reason])[0]
