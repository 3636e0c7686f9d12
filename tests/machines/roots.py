"""Roots of Debian with a CPython in them, unpacked and no more: no program of theirs is run.

So a root of another processor needs neither the kernel's binfmt_misc nor more rights than to make
files; kept while this recipe is the same.
"""

import hashlib
import shutil
import subprocess
from pathlib import Path
from typing import Final, NamedTuple

LIMIT_S: Final = 900.0
MAY_BE_OLD: Final = 'Acquire::Check-Valid-Until "false"'
"""A mirror's list of a suite that still changes expires when it is not renewed; it stays signed."""
PACKAGES: Final = ("python3-minimal", "libpython3-stdlib", "libstdc++6", "libgcc-s1")
ARCHITECTURES: Final = {"x86_64": "amd64", "aarch64": "arm64"}
_LOADERS: Final = {"x86_64": "ld-linux-x86-64.so.2", "aarch64": "ld-linux-aarch64.so.1"}
_MERGED: Final = ("bin", "sbin", "lib", "lib64")
"""Folders that are links into /usr, which a package's own script would make."""


class Root(NamedTuple):
    """A folder in which a Debian is unpacked."""

    folder: Path
    machine: str

    @property
    def python(self) -> Path:
        """Its CPython."""
        return next((self.folder / "usr/bin").glob("python3.[0-9]*[0-9]"))

    @property
    def libraries(self) -> Path:
        """Its libraries, the C library's among them."""
        return self.folder / f"usr/lib/{self.machine}-linux-gnu"

    @property
    def loader(self) -> Path:
        """The program that loads a program and its libraries."""
        return self.folder / "usr/lib64" / _LOADERS[self.machine]


def root_of(suite: str, machine: str, folder: Path) -> Root | str:
    """The root of a suite for a processor, made if it is not there; or why it cannot be."""
    if machine not in ARCHITECTURES:
        return f"no root for {machine}; expected {' or '.join(ARCHITECTURES)}"
    recipe = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:12]
    root = Root(folder.absolute() / f"{suite}-{machine}-{recipe}", machine)
    if root.folder.exists():
        return root
    unfinished = root.folder.with_suffix(".unfinished")
    shutil.rmtree(unfinished, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    words = ["mmdebstrap", "--quiet", "--variant=extract", f"--aptopt={MAY_BE_OLD}"]
    words += [f"--architectures={ARCHITECTURES[machine]}", f"--include={','.join(PACKAGES)}"]
    made = subprocess.run(
        [*words, suite, str(unfinished)],
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    if made.returncode:
        return (made.stderr.strip().splitlines() or ["mmdebstrap failed"])[-1]
    for name in _MERGED:
        link = unfinished / name
        if not link.exists() and (unfinished / "usr" / name).is_dir():
            link.symlink_to(f"usr/{name}")
    unfinished.rename(root.folder)
    return root
