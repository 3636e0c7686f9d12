"""What is installed into: this machine with systemd running, or a directory."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from firmware_runtime.errors import InstallationRefused
from firmware_runtime.host.installation.tree import Tree

THIS_MACHINE = Path("/")
_SYSTEMD_RUNS = "/run/systemd/system"
_DEVICE_MANAGER_LISTENS = "/run/udev/control"


@dataclass(frozen=True, slots=True)
class Target:
    """A tree of files; `is_live` is whether systemd runs on it and is to be reloaded."""

    tree: Tree = field(default_factory=Tree)
    is_live: bool = False

    @property
    def has_device_manager(self) -> bool:
        """Whether udev runs; it does not in a container."""
        return self.tree.exists(_DEVICE_MANAGER_LISTENS)


def target(root: Path | None, *, dry_run: bool) -> Target:
    """The directory, or this machine if there is none. Raises InstallationRefused.

    Looking at what would be done takes neither root nor systemd.
    """
    if root is not None:
        return Target(Tree(root.absolute()))
    machine = Target(Tree(THIS_MACHINE), is_live=True)
    if not dry_run:
        require_systemd(", or --root DIR to change the files of one that is being built")
        if os.geteuid() != 0:
            raise InstallationRefused(
                "this user may not change the system's files",
                expected="root: use sudo, or --root DIR to write elsewhere, or --dry-run to "
                "see what would be done",
            )
    return machine


def require_systemd(or_else: str = "") -> None:
    """Raise InstallationRefused where systemd does not run; `or_else` is another way, if any."""
    if not Tree(THIS_MACHINE).exists(_SYSTEMD_RUNS):
        raise InstallationRefused(
            f"systemd does not run this machine (no {_SYSTEMD_RUNS})",
            expected=f"a system that it runs{or_else}",
        )
