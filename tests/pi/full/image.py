"""The card of an emulated Raspberry Pi: all of Debian 13, with a login by ssh; kept.

Its files are made once a recipe, from names of packages; programs of arm64 run here meanwhile by
QEMU's emulation of single programs. A card is an ext4 file system of them, and of the hand that
writes into the memories on the bus what the host's doubles are. The program under test is not
on it.
"""

import hashlib
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Final, NamedTuple

from tests.pi.image import SUITE, add_program
from tests.pi.image import Image as Emulator
from tests.support.ssh_target import make_key
from tests.vm.commands import run
from tests.vm.image import (
    LEFT_OUT,
    NOTHING_LATER,
    add_modules,
    files_of,
    host_sources,
    packed,
)

HERE: Final = Path(__file__).parent
PROJECT: Final = HERE.parents[2]
PACKAGES: Final = (
    *("systemd-sysv", "udev", "dbus", "kmod", "procps", "iproute2", "adduser"),
    *("openssh-server", "sudo", "rsync", "python3", "python3-venv", "i2c-tools", "git", "make"),
)
"""What a fresh card of Raspberry Pi OS has and a robot needs, with that of docs/raspberry-pi.md."""
BOOT_MODULES: Final = ("bcm2835-rng", "bcm2835", "sdhci-iproc", "ext4")
"""The first since systemd waits for random numbers: two minutes, without it."""
MODULES: Final = (*BOOT_MODULES, "i2c-bcm2835", "i2c-dev", "dwc2", "phy-generic", "cdc_ether")
SIZE: Final = "2G"
"""A power of two, or QEMU's card reader does not take it."""
USER: Final = "pi"
KIND: Final = "stock"
BINFMT: Final = Path("/proc/sys/fs/binfmt_misc")
ARM64: Final = Path("/usr/lib/binfmt.d/qemu-aarch64.conf")


class Image(NamedTuple):
    """A folder with the guest's files as they are after installation."""

    folder: Path

    @property
    def root(self) -> Path:
        """Return its files."""
        return self.folder / "root"

    @property
    def initrd(self) -> Path:
        """Return what brings up the card."""
        return self.folder / "initrd"

    @property
    def key(self) -> Path:
        """Return the key that logs in as root and as USER."""
        return self.folder / "user"


def built(folder: Path, emulator: Emulator) -> Image:
    """Return the image of the present recipe, made unless it is there."""
    recipe = [Path(__file__), host_sources(), *sorted((HERE / "laid_in").rglob("*"))]
    contents = b"\0".join(path.read_bytes() for path in recipe if path.is_file())
    image = Image(folder.absolute() / hashlib.sha256(contents).hexdigest()[:12])
    if not image.folder.exists():
        shutil.rmtree(folder, ignore_errors=True)
        work = Image(folder.absolute() / "new")
        work.folder.mkdir(parents=True)
        _let_arm64_run()
        _bootstrap(work)
        _add_kernel(work, emulator)
        shutil.copytree(HERE / "laid_in/root", work.root, symlinks=True, dirs_exist_ok=True)
        _let_in(work)
        work.folder.rename(image.folder)
    return image


def make_card(card: Path, image: Image, wheels: Path) -> None:
    """Write a card with the image and the host's hand, which is of today's project."""
    hand = image.root / "opt/hand"
    shutil.rmtree(hand, ignore_errors=True)
    add_program(image.root, hand, wheels)
    for folder in ("tests/vm/guest", "tests/pi/guest"):
        shutil.copytree(PROJECT / folder, hand / folder, ignore=_CACHES)
    card.unlink(missing_ok=True)
    run("mke2fs", "-q", "-t", "ext4", *NOTHING_LATER, "-d", image.root, card, SIZE)


_CACHES: Final = shutil.ignore_patterns("__pycache__")


def _let_arm64_run() -> None:
    """Have this kernel start programs of arm64, as systemd does at boot where it runs."""
    if not (BINFMT / "register").exists():
        run("mount", "-t", "binfmt_misc", "none", BINFMT)
    if not (BINFMT / "qemu-aarch64").exists():
        (BINFMT / "register").write_text(ARM64.read_text())


def _bootstrap(image: Image) -> None:
    sources = image.folder / host_sources().name
    text = re.sub(r"\bbookworm\b|\btrixie\b", SUITE, host_sources().read_text())
    sources.write_text(text)
    run(
        *("mmdebstrap", "--quiet", "--variant=minbase", "--architectures=arm64"),
        *(f"--include={','.join(PACKAGES)}", "--skip=check/qemu"),
        *(f"--dpkgopt=path-exclude={pattern}" for pattern in LEFT_OUT),
        f'--customize-hook=chroot "$1" useradd --create-home --shell /bin/bash {USER}',
        '--customize-hook=chroot "$1" groupadd --system gpio',
        '--customize-hook=chroot "$1" systemctl enable systemd-networkd',
        *(SUITE, image.root, sources),
    )


def _add_kernel(image: Image, emulator: Emulator) -> None:
    """Add the modules that this computer needs, and pack those that find its card."""
    kernel = image.folder / "kernel"
    kernel.mkdir()
    (kernel / "lib").symlink_to(emulator.folder / KIND / "usr/lib")
    version = next((kernel / "lib/modules").iterdir()).name
    run("depmod", "--basedir", kernel, version)
    add_modules(MODULES, kernel, image.root, version)
    root = image.folder / "initrd.root"
    for name in ("bin", "dev", "modules", "root"):
        (root / name).mkdir(parents=True)
    shutil.copy(next((emulator.folder / "guest").glob("usr/bin/busybox")), root / "bin")
    init = (PROJECT / "tests/vm/laid_in/init").read_text().replace("/dev/vda", "/dev/mmcblk0")
    (root / "init").write_text(init)
    (root / "init").chmod(0o755)
    files = files_of(BOOT_MODULES, kernel, version)
    for file in files:
        with (root / "modules" / file.stem).open("wb") as module:
            subprocess.run(["xz", "--decompress", "--stdout", file], stdout=module, check=True)
    (root / "modules/order").write_text("".join(f"{file.stem}\n" for file in files))
    image.initrd.write_bytes(packed(root))
    shutil.rmtree(root)


def _let_in(image: Image) -> None:
    """Let one key log in as root and as USER, whom sudo asks for no password."""
    make_key(image.key)
    home = image.root / "home" / USER
    owner = home.stat()
    for folder, user, group in (
        (image.root / "root", 0, 0),
        (home, owner.st_uid, owner.st_gid),
    ):
        keys = folder / ".ssh"
        keys.mkdir(mode=0o700, exist_ok=True)
        shutil.copy(image.key.with_suffix(".pub"), keys / "authorized_keys")
        for path in (keys, keys / "authorized_keys"):
            os.chown(path, user, group)
    sudoers = image.root / "etc/sudoers.d" / USER
    sudoers.write_text(f"{USER} ALL=(ALL) NOPASSWD: ALL\n")
    sudoers.chmod(0o440)
