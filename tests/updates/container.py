"""A Debian with its own systemd and sshd, in a container: real services, on this kernel.

Its network is this machine's; ssh listens on a port of loopback. What happens in it is gone with
it; the image is kept while its recipe is the same.
"""

import hashlib
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.support.ssh_target import HOST, SshTarget, free_port, make_key
from tests.support.waiting import wait_until
from tests.vm.image import bootstrap

PACKAGES: Final = (
    *("systemd-sysv", "dbus", "udev", "procps", "util-linux", "adduser", "iproute2"),
    *("python3", "python3-venv", "openssh-server", "rsync", "sudo"),
)
IN_USE: Final = "systemctl is-system-running --wait; true"


def image_in(folder: Path) -> Path:
    """Return the folder of the image of the present recipe; made if it is not there."""
    recipe = hashlib.sha256(" ".join(PACKAGES).encode()).hexdigest()[:12]
    home = folder.absolute() / recipe
    if not home.exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        work = home.with_suffix(".new")
        bootstrap(work, PACKAGES)
        work.rename(home)
    return home


@dataclass
class Container:
    """A computer to deploy to."""

    ssh: SshTarget

    def run(self, command: str) -> "subprocess.CompletedProcess[str]":
        """Run a command of its shell by ssh, to its end."""
        words = self.ssh.login(command)
        return subprocess.run(words, capture_output=True, text=True, check=False)


@contextmanager
def booted(image: Path, folder: Path, nodes: Mapping[str, str]) -> Iterator[Container]:
    """Boot the image, with a layer above it; `nodes`: devices of this machine, by names there.

    Raises AssertionError where it does not come up.
    """
    folder.mkdir(parents=True)
    target, key = SshTarget(folder, free_port()), make_key(folder / "user")
    target.know(image / "etc/ssh/ssh_host_ed25519_key.pub")
    listens = folder / "listens.conf"
    listens.write_text(f"Port {target.port}\nListenAddress {HOST}\n")
    seen = {
        "/root/.ssh/authorized_keys": key.with_suffix(".pub"),
        "/etc/ssh/sshd_config.d/listens.conf": listens,
        **nodes,
    }
    words = ["systemd-nspawn", "--quiet", "--boot", "--register=no", "--keep-unit"]
    words += ["--capability=all", "--console=pipe", f"--directory={image}", "--volatile=overlay"]
    words += [f"--bind={here}:{there}" for there, here in seen.items()]
    with (folder / "console.log").open("wb") as console:
        machine = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=console, stderr=console)
    container = Container(target)
    try:
        wait_until(
            lambda: machine.poll() is None and container.run(IN_USE).returncode == 0,
            "the container answers by ssh",
            lambda: (folder / "console.log").read_text(errors="replace")[-2000:],
        )
        yield container
    finally:
        machine.terminate()
        machine.wait()
