"""The guest's disk, kernel and first file system, of Debian packages; kept while the recipe is.

The suite and the mirror are the host's own. The program's venv is there with what the program
depends on, since the guest has no network and is slow; the program itself comes with every run.
"""

import hashlib
import platform
import shutil
import subprocess
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from tests.vm.commands import run
from tests.vm.wheels import fetch_wheels

HERE: Final = Path(__file__).parent
PROJECT: Final = HERE.parents[1] / "pyproject.toml"
VENV: Final = "/opt/firmware-runtime/venv"
PACKAGES: Final = (
    *("systemd-sysv", "udev", "kmod", "procps", "util-linux", "adduser"),
    *("python3", "python3-venv", "i2c-tools", "iproute2"),
)
LEFT_OUT: Final = ("/usr/share/doc/*", "/usr/share/man/*", "/usr/share/locale/*")
KERNEL: Final = "linux-image-amd64"
BOOT_MODULES: Final = ("virtio_pci", "virtio_blk", "ext4", "virtio_console")
MODULES: Final = (*BOOT_MODULES, "vhci-hcd", "i2c-tiny-usb", "i2c-dev", "veth", "sch_netem")
NOTHING_LATER: Final = ("-E", "lazy_itable_init=0,lazy_journal_init=0")
SIZE: Final = "1400M"


class Image(NamedTuple):
    """What QEMU boots, and the version of the Python on it."""

    kernel: Path
    initrd: Path
    disk: Path
    python: Path

    @property
    def is_there(self) -> bool:
        """Whether all of it was made."""
        return all(path.exists() for path in self)


def image_in(folder: Path) -> Image:
    """Where the image of the present recipe is, or would be."""
    recipe = [Path(__file__), PROJECT, host_sources(), *sorted((HERE / "laid_in").rglob("*"))]
    contents = b"\0".join(path.read_bytes() for path in recipe if path.is_file())
    home = folder.absolute() / hashlib.sha256(contents).hexdigest()[:12]
    return Image(home / "vmlinuz", home / "initrd", home / "disk", home / "python")


def build(image: Image) -> None:
    """Make it; what another recipe left behind is removed."""
    home = image.disk.parent
    shutil.rmtree(home.parent, ignore_errors=True)
    work = home / "work"
    work.mkdir(parents=True)
    root, kernel = work / "root", work / "kernel"
    bootstrap(root, PACKAGES)
    image.python.write_text(_python_of(root), encoding="ascii")
    version = _unpack_kernel(work, kernel)
    (kernel / "boot" / f"vmlinuz-{version}").rename(image.kernel)
    _make_initrd(work / "initrd", kernel, version, image.initrd)
    add_modules(MODULES, kernel, root, version)
    _add_dependencies(root, work / "wheels")
    shutil.copytree(HERE / "laid_in" / "root", root, dirs_exist_ok=True)
    run("mke2fs", "-q", "-t", "ext4", *NOTHING_LATER, "-d", root, work / "disk", SIZE)
    (work / "disk").rename(image.disk)
    shutil.rmtree(work)


def host_sources() -> Path:
    """The host's own list of Debian's mirrors."""
    deb822 = Path("/etc/apt/sources.list.d/debian.sources")
    return deb822 if deb822.exists() else Path("/etc/apt/sources.list")


def bootstrap(root: Path, packages: Sequence[str]) -> None:
    """Unpack and set up packages of the host's own suite, with all that they need."""
    leave_out = [f"--dpkgopt=path-exclude={pattern}" for pattern in LEFT_OUT]
    include = f"--include={','.join(packages)}"
    suite = platform.freedesktop_os_release()["VERSION_CODENAME"]
    run(
        "mmdebstrap",
        "--quiet",
        "--variant=minbase",
        include,
        *leave_out,
        suite,
        root,
        host_sources(),
    )


def _python_of(root: Path) -> str:
    """The version of the guest's Python, such as 3.11."""
    return (root / "usr/bin/python3").readlink().name.removeprefix("python")


def _unpack_kernel(work: Path, kernel: Path) -> str:
    """Unpack the kernel's package and no more of it than that; return the kernel's version."""
    depends = run("apt-cache", "depends", KERNEL)
    package = next(
        word for word in depends.split() if word.startswith("linux-image-") and word != KERNEL
    )
    run("apt-get", "download", "--quiet", package, cwd=work)
    kernel.mkdir()
    run("dpkg-deb", "--extract", next(work.glob("linux-image-*.deb")), kernel)
    version = next((kernel / "lib/modules").iterdir()).name
    run("depmod", "--basedir", kernel, version)
    return version


def files_of(modules: Sequence[str], kernel: Path, version: str) -> list[Path]:
    """Return the files of modules and of what they need, in the order of loading."""
    files: dict[Path, None] = {}
    for module in modules:
        shown = run(
            "modprobe", "--dirname", kernel, "--set-version", version, "--show-depends", module
        )
        for line in shown.splitlines():
            if line.startswith("insmod "):
                files[Path(line.split()[1])] = None
    return list(files)


def _make_initrd(root: Path, kernel: Path, version: str, initrd: Path) -> None:
    """Pack what brings up the disk: busybox, a few modules and a script."""
    for folder in ("bin", "dev", "modules", "root"):
        (root / folder).mkdir(parents=True)
    shutil.copy("/bin/busybox", root / "bin")
    for script in ("init", "probe"):
        shutil.copy(HERE / "laid_in" / script, root)
    modules = files_of(BOOT_MODULES, kernel, version)
    for file in modules:
        shutil.copy(file, root / "modules")
    order = "".join(f"{file.name}\n" for file in modules)
    (root / "modules/order").write_text(order, encoding="ascii")
    initrd.write_bytes(packed(root))


def packed(root: Path) -> bytes:
    """Return a folder as the kernel takes a first file system."""
    names = "\n".join(str(path.relative_to(root)) for path in root.rglob("*"))
    command = ["cpio", "--quiet", "--create", "--format=newc"]
    done = subprocess.run(
        command, cwd=root, input=names.encode(), stdout=subprocess.PIPE, check=True
    )
    return done.stdout


def add_modules(modules: Sequence[str], kernel: Path, root: Path, version: str) -> None:
    """Copy the modules that the guest needs, and no others: some 3 MB of 390."""
    for file in files_of(modules, kernel, version):
        target = root / file.relative_to(kernel)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, target)
    for file in (kernel / "lib/modules" / version).glob("modules.builtin*"):
        shutil.copy(file, root / "lib/modules" / version)
    run("depmod", "--basedir", root, version)


def _add_dependencies(root: Path, wheels: Path) -> None:
    """Make the venv, with what the project depends on and without the project."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    python = _python_of(root)
    fetch_wheels(project["dependencies"], wheels, python)
    run("chroot", root, "python3", "-m", "venv", "--system-site-packages", VENV)
    shutil.copytree(wheels, root / "wheels")
    names = [f"/wheels/{wheel.name}" for wheel in wheels.iterdir()]
    run("chroot", root, f"{VENV}/bin/python", "-m", "pip", "install", "--no-index", *names)
    shutil.rmtree(root / "wheels")
