"""A computer to deploy to: this one, by a real sshd on loopback with keys of its own."""

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.support.waiting import wait_until

SSHD = Path("/usr/sbin/sshd")
DEBIANS_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
HOST = "127.0.0.1"

_CONFIG = """\
Port {port}
ListenAddress {host}
HostKey {folder}/host
AuthorizedKeysFile {keys}
StrictModes no
PidFile none
UsePAM no
PasswordAuthentication no
KbdInteractiveAuthentication no
PermitRootLogin yes
ForceCommand env -i HOME="$HOME" PATH={path} sh -c "$SSH_ORIGINAL_COMMAND"
"""


def missing_packages() -> str:
    """The Debian packages that a target needs and this computer lacks; empty if there is none."""
    there = {
        "openssh-server": SSHD.exists(),
        "openssh-client": shutil.which("ssh") is not None,
        "rsync": shutil.which("rsync") is not None,
        "python3": Path("/usr/bin/python3").exists(),
    }
    return " ".join(package for package, is_there in there.items() if not is_there)


@dataclass
class SshTarget:
    """Where it listens, and the options that a deployment to it needs."""

    folder: Path
    port: int
    identity: Path = field(init=False)

    def __post_init__(self) -> None:
        self.identity = self.folder / "user"

    @property
    def words(self) -> list[str]:
        """HOST's options on the command line of `deploy`."""
        known = f"UserKnownHostsFile={self.folder / 'known_hosts'}"
        return ["--port", str(self.port), "--identity", str(self.identity), "-o", known]

    @property
    def options(self) -> tuple[str, ...]:
        """Options of ssh itself that lead there."""
        known = f"-oUserKnownHostsFile={self.folder / 'known_hosts'}"
        return (known, f"-oPort={self.port}", f"-oIdentityFile={self.identity}")

    def login(self, command: str, user: str = "root") -> list[str]:
        """The command line that runs a shell's command there."""
        quiet = ("-oBatchMode=yes", "-oConnectTimeout=20", "-oLogLevel=ERROR")
        return ["ssh", *self.options, *quiet, f"{user}@{HOST}", "--", command]

    def know(self, host_key: Path) -> None:
        """Let ssh know the computer by its public key."""
        known = f"[{HOST}]:{self.port} {host_key.read_text()}"
        (self.folder / "known_hosts").write_text(known)


def make_key(path: Path) -> Path:
    """A new key without a passphrase."""
    subprocess.run(
        ["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(path)],
        check=True,
        stdin=subprocess.DEVNULL,
    )
    return path


def free_port() -> int:
    """A port of loopback without a listener."""
    with socket.socket() as free:
        free.bind((HOST, 0))
        return int(free.getsockname()[1])


ATTEMPTS = 5
"""How many ports are tried."""


@contextmanager
def ssh_target(
    folder: Path, *, path: str = DEBIANS_PATH, inside: Sequence[str] = (), keys: str = ""
) -> Iterator[SshTarget]:
    """Start one, whose commands are found on `path`.

    `inside` are the words that start a program elsewhere, such as in another root; `keys` is the
    file there that holds the keys that may log in, one of its own if there is none.
    """
    folder.mkdir(parents=True)
    if os.geteuid() == 0:
        Path("/run/sshd").mkdir(exist_ok=True)  # where sshd as root insists on having a folder
    make_key(folder / "host")
    make_key(folder / "user")
    settings = {"host": HOST, "folder": folder, "path": path, "keys": keys or f"{folder}/user.pub"}
    target, process = _listening(folder, settings, inside)
    try:
        yield target
    finally:
        process.terminate()
        process.wait()


def _listening(
    folder: Path, settings: dict[str, object], inside: Sequence[str]
) -> tuple[SshTarget, subprocess.Popen[bytes]]:
    """An sshd that listens, on another port where the one that was free has been taken since."""
    log = folder / "sshd.log"
    for _ in range(ATTEMPTS):
        target = SshTarget(folder, free_port())
        target.know(folder / "host.pub")
        config = folder / "sshd_config"
        config.write_text(_CONFIG.format(port=target.port, **settings))
        with log.open("w") as file:
            words = [*inside, str(SSHD), "-D", "-e", "-f", str(config)]
            process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stderr=file)
        if _comes_up(process, target.port):
            return target, process
    raise AssertionError(f"sshd did not listen in {ATTEMPTS} attempts: {log.read_text()}")


def _comes_up(process: subprocess.Popen[bytes], port: int) -> bool:
    """Whether it listens, and has not ended instead."""
    wait_until(lambda: process.poll() is not None or _listens(port), "sshd listens or ends")
    return process.poll() is None


def _listens(port: int) -> bool:
    with socket.socket() as asking:
        return asking.connect_ex((HOST, port)) == 0
