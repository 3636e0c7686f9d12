"""This computer's own system below a layer: what is installed into it is gone afterwards.

An overlay in a mount namespace, in which root can deploy for real. There is no systemd
in it; a `systemctl` of ours notes what it is asked and runs a robot on its doubles.
"""

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.support.waiting import PATIENCE_S

SYSTEMCTL = Path(__file__).with_name("systemctl.sh")
SYSTEMD_RUN = Path(__file__).with_name("systemd-run.sh")

ROBOT = "firmware-runtime@tachobot.service"
GUARD = "firmware-runtime-guard@tachobot.service"
PROGRAM = "/opt/firmware-runtime/venv/bin/firmware-runtime"
MANIFEST = "/opt/firmware-runtime/venv/manifest"
SETTINGS = "/etc/firmware-runtime/tachobot.toml"

_SAFE_STATE = """\
#!/bin/sh
if [ "$1" = stats ]; then
	exit 2 # a busy machine may be slower than before: nothing to compare with
fi
if [ "$1" = safe-state ]; then
	echo "$@" >>/run/safe-state.log
	exit {status}
fi
exec {program}.real "$@"
"""
_SET_UP = """
set -e
mount -t tmpfs tmpfs "$1"
mkdir "$1/upper" "$1/work" "$1/root"
mount -t overlay overlay -o "lowerdir=/,upperdir=$1/upper,workdir=$1/work" "$1/root"
mount -t proc proc "$1/root/proc"
mount --rbind /dev "$1/root/dev"
mkdir -p "$1/root$2" "$1/root/run/systemd/system" "$1/root/run/sshd"
mount --bind "$2" "$1/root$2"
rm -rf "$1/root/opt/firmware-runtime" "$1/root/etc/firmware-runtime" "$1/root/run/firmware-runtime"
install -m 755 "$3" "$1/root/usr/bin/systemctl"
install -m 755 "$4" "$1/root/usr/bin/systemd-run"
echo ready
cat
true # so that this shell stays, and as process 1 takes up what others leave
"""


@dataclass
class ScratchSystem:
    """The layer; `folder` is one of ours that is seen in it under the same name."""

    inside: list[str]
    """The words that start a program in it."""
    folder: Path

    def run(self, *words: object) -> "subprocess.CompletedProcess[str]":
        """Run a program in it, to its end."""
        return subprocess.run(
            [*self.inside, *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
            timeout=PATIENCE_S,
        )

    def has(self, path: str) -> bool:
        """Whether there is such a file."""
        return self.run("test", "-e", path).returncode == 0

    def read(self, path: str) -> str:
        """What stands in a file."""
        done = self.run("cat", path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def write(self, path: str, text: str, mode: int = 0o644) -> None:
        """Put a file there."""
        brought = self.folder / "brought"
        brought.write_text(text)
        words: Sequence[object] = ("install", "-D", "-m", f"{mode:o}")
        done = self.run(*words, brought, path)
        assert done.returncode == 0, done.stderr

    def let_safe_state_end_with(self, status: int) -> None:
        """Give the program in use a `safe-state` that ends so; there is no bus to write to."""
        if not self.has(f"{PROGRAM}.real"):
            assert self.run("mv", PROGRAM, f"{PROGRAM}.real").returncode == 0
        assert self.run("rm", "-f", MANIFEST).returncode == 0  # it is not what was deployed
        self.write(PROGRAM, _SAFE_STATE.format(status=status, program=PROGRAM), 0o755)


@contextmanager
def scratch_system(folder: Path) -> Iterator[ScratchSystem]:
    """Set one up. Raises OSError with the reason where the kernel does not allow it."""
    place, shared = folder / "scratch", folder / "shared"
    place.mkdir(parents=True)
    shared.mkdir()
    words = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", _SET_UP, "sh"]
    holder = subprocess.Popen(
        [*words, str(place), str(shared), str(SYSTEMCTL), str(SYSTEMD_RUN)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert holder.stdout is not None
    assert holder.stderr is not None
    try:
        if holder.stdout.readline() != "ready\n":
            raise OSError(holder.stderr.read().strip())
        children = Path(f"/proc/{holder.pid}/task/{holder.pid}/children").read_text().split()
        enter = ["nsenter", f"--target={children[0]}", "--mount", "--pid", "chroot"]
        environment = ["env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "HOME=/root"]
        yield ScratchSystem([*enter, f"{place}/root", *environment], shared)
    finally:
        holder.communicate(input="")
