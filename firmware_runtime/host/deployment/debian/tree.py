"""What is in the Debian package, as a folder that dpkg-deb makes a package of."""

import gzip
import shutil
from hashlib import md5
from pathlib import Path

from firmware_runtime.host.deployment.platform import GLIBC, MACHINES, Platform

NAME = "firmware-runtime"
WHEELS = "usr/share/firmware-runtime/wheels"
DOCUMENTS = "usr/share/doc/firmware-runtime"
PROGRAM = "/opt/firmware-runtime/venv/bin/firmware-runtime"
SCRIPTS = {
    "postinst": ("venvs.sh", "robots.sh", "debian/places.sh", "debian/postinst.sh"),
    "prerm": ("robots.sh", "debian/places.sh", "debian/prerm.sh"),
    "postrm": ("debian/places.sh", "debian/postrm.sh"),
}
"""Maintainer scripts, and the files of this project that each is made of."""

_HERE = Path(__file__).parents[1]
_CONTROL = """\
Package: {name}
Version: {version}
Architecture: {architecture}
Maintainer: the firmware-runtime maintainers
Installed-Size: {size_kib}
Depends: {depends}
Section: science
Priority: optional
Description: runs DEVS models as the firmware of a robot
 The program and the Python packages it needs, as wheels for one Python.
 Installing makes a virtual environment of them in /opt/firmware-runtime
 that also sees the system's packages; it needs neither a compiler nor the
 network. `firmware-runtime service install BOARD` makes a robot a service.
"""


def fill(tree: Path, platform: Platform, version: str, source: Path) -> None:
    """Complete a tree that has the wheels already: documents, link, scripts, control.

    `source` is the checkout, for licence and changes.
    """
    documents = tree / DOCUMENTS
    documents.mkdir(parents=True)
    shutil.copyfile(source / "LICENSE", documents / "copyright")
    changes = (source / "CHANGELOG.md").read_bytes()
    (documents / "changelog.gz").write_bytes(gzip.compress(changes, mtime=0))
    program = tree / "usr" / "bin" / NAME
    program.parent.mkdir(parents=True)
    program.symlink_to(PROGRAM)
    _write_control(tree, platform, version)
    for place in tree.rglob("*"):
        if not place.is_symlink():
            executable = place.is_dir() or place.name in SCRIPTS
            place.chmod(0o755 if executable else 0o644)
    tree.chmod(0o755)


def script_text(name: str) -> str:
    """A maintainer script: the files it is made of, one behind the other."""
    parts = [(_HERE / part).read_text() for part in SCRIPTS[name]]
    return "\n".join(["#!/bin/sh\nset -e\n", *parts])


def _write_control(tree: Path, platform: Platform, version: str) -> None:
    files = sorted(each for each in tree.rglob("*") if each.is_file() and not each.is_symlink())
    control = tree / "DEBIAN"
    control.mkdir()
    sums = (f"{_md5(file)}  {file.relative_to(tree)}\n" for file in files)
    (control / "md5sums").write_text("".join(sums))
    for name in SCRIPTS:
        (control / name).write_text(script_text(name))
    (control / "control").write_text(
        _CONTROL.format(
            name=NAME,
            version=version,
            architecture=MACHINES[platform.machine],
            size_kib=sum(file.stat().st_size for file in files) // 1024,
            depends=", ".join(_depends(platform)),
        )
    )


def _depends(platform: Platform) -> list[str]:
    major, minor = platform.python
    return [
        f"python3 (>= {major}.{minor})",
        f"python3 (<< {major}.{minor + 1})",
        "python3-venv",
        f"libc6 (>= {GLIBC[0]}.{GLIBC[1]})",
    ]


def _md5(file: Path) -> str:
    return md5(file.read_bytes(), usedforsecurity=False).hexdigest()
