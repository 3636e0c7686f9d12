"""QEMU with a Raspberry Pi's I2C controllers, its kernel, and a file system in memory; kept.

All of Debian 13, whatever the host's own suite is, from the host's own mirror: QEMU 10 has the
controllers, 7.2 of Debian 12 has not. Nothing is installed: packages are unpacked, and QEMU is
started by the dynamic linker that came with it. The program's wheels are those for arm64.
"""

import hashlib
import platform
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from tests.vm.commands import Unbuildable, run
from tests.vm.image import host_sources, packed
from tests.vm.wheels import pip

HERE: Final = Path(__file__).parent
PROJECT: Final = HERE.parents[1]
SUITE: Final = "trixie"
KERNELS: Final = {"stock": "linux-image-arm64", "rt": "linux-image-rt-arm64"}
GUEST: Final = ("python3", "busybox-static")
NOT_UNPACKED: Final = ("debconf", "dpkg", "perl-base", "tar", "tzdata")
"""What comes along only because something that is configured would need it."""
MODULES: Final = ("i2c-bcm2835", "i2c-dev")
PLATFORMS: Final = ("manylinux2014_aarch64", "manylinux_2_28_aarch64")
SITE: Final = "usr/lib/python3/dist-packages"


class Image(NamedTuple):
    """A folder with QEMU, kernels and the guest's files, all unpacked."""

    folder: Path

    @property
    def qemu(self) -> list[str]:
        """Return the words that start QEMU."""
        root = self.folder / "qemu"
        libraries = f"{root}/usr/lib/x86_64-linux-gnu"
        loader = root / "usr/lib64/ld-linux-x86-64.so.2"
        program = root / "usr/bin/qemu-system-aarch64"
        return [
            str(loader),
            "--library-path",
            libraries,
            str(program),
            "-L",
            f"{root}/usr/share/qemu",
        ]

    def kernel(self, kind: str) -> Path:
        """Return the kernel of a kind."""
        return next((self.folder / kind / "boot").glob("vmlinuz-*"))

    def device_tree(self, kind: str) -> Path:
        """Return that of a Raspberry Pi 3B, from the kernel's package."""
        return next((self.folder / kind).glob("usr/lib/linux-image-*/broadcom/bcm2837-rpi-3-b.dtb"))

    def initrd(self, kind: str) -> Path:
        """Return the guest's file system, packed."""
        return self.folder / f"initrd-{kind}.gz"


def why_impossible() -> str | None:
    """Why this machine cannot have it, in a sentence."""
    if platform.machine() == "x86_64" and Path("/etc/debian_version").exists():
        return None
    return "QEMU is unpacked from Debian's packages for x86_64"


def built(folder: Path, kinds: Sequence[str]) -> Image:
    """Return the image of the present recipe with these kernels; what is missing is made."""
    recipe = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:12]
    home = folder.absolute() / recipe
    image = Image(home)
    apt = Apt(home / "apt")
    if not (home / "qemu").exists():
        shutil.rmtree(folder, ignore_errors=True)
        home.mkdir(parents=True)
        apt.set_up()
        _unpack(apt.closure("amd64", ("qemu-system-arm",)), home / "qemu")
        _unpack(apt.closure("arm64", GUEST), home / "guest")
    for kind in kinds:
        if not (home / kind).exists():
            _unpack([apt.newest_kernel(KERNELS[kind])], home / kind)
    return image


def pack(image: Image, kind: str, wheel_folder: Path) -> None:
    """Pack the guest's files with the project as it is now, its checks, and a kernel's modules."""
    root = image.folder / "root"
    shutil.rmtree(root, ignore_errors=True)
    shutil.copytree(image.folder / "guest", root, symlinks=True)
    _add_modules(image.folder / kind, root / "modules")
    add_program(root, root / SITE, wheel_folder)
    for name in ("proc", "sys", "dev", "tmp", "run", "root"):
        (root / name).mkdir(exist_ok=True)
    for name in ("bin", "lib"):
        (root / name).symlink_to(f"usr/{name}")
    shutil.copy(HERE / "laid_in/init", root / "init")
    for folder in ("tests/vm/guest", "tests/pi/guest"):
        shutil.copytree(PROJECT / folder, root / "checks" / folder, ignore=_CACHES)
    plain = image.initrd(kind).with_suffix("")
    plain.write_bytes(packed(root))
    run("gzip", "--fast", "--force", plain)
    shutil.rmtree(root)


_CACHES: Final = shutil.ignore_patterns("__pycache__")


class Apt:
    """Debian's own client, with lists and a cache of its own: the host's packages do not count."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._archives = folder / "cache/archives"

    def set_up(self) -> None:
        """Fetch the lists of packages."""
        for name in ("lists/partial", "cache/archives/partial"):
            (self._folder / name).mkdir(parents=True)
        suite = re.compile(r"\bbookworm\b|\btrixie\b")
        sources = self._folder / host_sources().name
        sources.write_text(suite.sub(SUITE, host_sources().read_text()))
        (self._folder / "status").touch()
        (self._folder / "conf").write_text(
            f'Dir::Etc::sourcelist "{sources}";\n'
            'Dir::Etc::sourceparts "/dev/null";\n'
            f'Dir::State::lists "{self._folder}/lists";\n'
            f'Dir::State::status "{self._folder}/status";\n'
            f'Dir::Cache "{self._folder}/cache";\n'
            'APT::Sandbox::User "root";\n'
            'Acquire::Languages "none";\n'
            'APT::Architectures { "amd64"; "arm64"; };\n'
        )
        self._run("update", "-qq")

    def closure(self, machine: str, packages: Sequence[str]) -> list[Path]:
        """Fetch packages with all that they depend on; return their files."""
        words = ("-o", f"APT::Architecture={machine}", "--download-only", "-y", "-qq")
        self._run(*words, "install", "--no-install-recommends", *packages)
        return self._fetched()

    def newest_kernel(self, name: str) -> Path:
        """Fetch the package that a kernel's name stands for."""
        shown = run(
            "env", f"APT_CONFIG={self._folder}/conf", "apt-cache", "depends", f"{name}:arm64"
        )
        found = re.search(r"Depends: (linux-image-\S+)", shown)
        if found is None:
            raise Unbuildable(f"{name}: no kernel in {SUITE}")
        run(
            "env",
            f"APT_CONFIG={self._folder}/conf",
            "apt-get",
            "download",
            "-qq",
            found[1],
            cwd=self._folder,
        )
        return next(self._folder.glob("linux-image-*.deb"))

    def _fetched(self) -> list[Path]:
        kept = self._folder / "packages"
        kept.mkdir(exist_ok=True)
        return [each.replace(kept / each.name) for each in self._archives.glob("*.deb")]

    def _run(self, *words: str) -> None:
        run("env", f"APT_CONFIG={self._folder}/conf", "apt-get", *words)


def _unpack(packages: Sequence[Path], into: Path) -> None:
    work = into.with_name(f"{into.name}.new")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    for package in packages:
        if package.name.partition("_")[0] not in NOT_UNPACKED:
            run("dpkg-deb", "--extract", package, work)
        package.unlink()
    work.rename(into)


def _add_modules(kernel: Path, into: Path) -> None:
    into.mkdir()
    for name in MODULES:
        packed = next(kernel.rglob(f"{name}.ko.xz"))
        with (into / f"{name}.ko").open("wb") as file:
            subprocess.run(["xz", "--decompress", "--stdout", packed], stdout=file, check=True)


def add_program(root: Path, site: Path, wheels: Path) -> None:
    """Lay the project's wheel there and what it depends on, for arm64 and the root's Python."""
    wheel = next(wheels.glob("firmware_runtime-*.whl"))
    pip("install", *fitting(root), "--find-links", wheels, "--target", site, wheel)


def fitting(root: Path) -> list[str]:
    """Return pip's options that choose wheels for arm64 and the root's Python."""
    version = next((root / "usr/lib").glob("python3.*")).name.removeprefix("python")
    platforms = [f"--platform={platform}" for platform in PLATFORMS]
    return [*platforms, f"--python-version={version}", "--implementation=cp", "--only-binary=:all:"]
