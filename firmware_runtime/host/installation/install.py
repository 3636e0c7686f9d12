"""Installing a board as a service; once or again, the outcome is the same."""

import shlex
from collections.abc import Callable, Iterator

from firmware_runtime.board.registry import Board
from firmware_runtime.host.installation.changes import (
    Change,
    Fate,
    carry_out,
    changes,
    settings_in_force,
)
from firmware_runtime.host.installation.drop_in import device_nodes
from firmware_runtime.host.installation.places import (
    GUARD,
    RUNTIME,
    SYSTEM_USERS,
    TEMPORARY_FILES,
    instance,
    links,
)
from firmware_runtime.host.installation.plan import files_of
from firmware_runtime.host.installation.programs import Words, run
from firmware_runtime.host.installation.target import Target

Log = Callable[[str], None]
_OWN_NODES = ("cpu_dma_latency", "i2c-*", "gpiochip*")
"""What our udev rules are about, by the kernel's names."""


class Installation:
    """A board about to be installed into a target.

    Raises ConfigError or InstallationRefused while nothing is written yet.
    """

    def __init__(self, board: Board, target: Target, program: str, version: str) -> None:
        shipped = board.source.read_text(encoding="utf-8")
        self._board = settings_in_force(board, target.tree)
        self._target = target
        plan = files_of(self._board, shipped, program, version)
        self._changes = changes(plan, target.tree)

    def preview(self, log: Log, *, start: bool) -> None:
        """Show every file and what would be run."""
        tree = self._target.tree
        for change in self._changes:
            file = change.file
            log(f"### {tree.where(file.path)}, mode {file.mode:04o}: {_would_be(change)}")
            log(file.content)
            self._show_difference(change, log)
        for path, to in self._links():
            log(f"### {tree.where(path)} -> {to}")
        for words in self._commands(start=start):
            log(f"$ {shlex.join(words)}")

    def carry_out(self, log: Log, *, start: bool) -> None:
        """Write what is missing or differs; reload systemd if it runs there. Raises StepFailed."""
        tree = self._target.tree
        for change in self._changes:
            carry_out(change, tree)
            log(f"{change.fate}: {tree.where(change.file.path)}")
            self._show_difference(change, log)
        for path, to in self._links():
            log(f"{'unchanged' if tree.exists(path) else 'linked'}: {tree.where(path)}")
            tree.link(path, to)
        for words in self._commands(start=start):
            run(words, log)

    def missing_nodes(self) -> list[str]:
        """Device nodes that the board needs and this machine does not have."""
        if not self._target.is_live:
            return []
        return [node for node in device_nodes(self._board) if not self._target.tree.exists(node)]

    @property
    def changes_units(self) -> bool:
        """Whether anything that was there already is overwritten."""
        return any(each.fate is Fate.WRITTEN and each.there is not None for each in self._changes)

    def _show_difference(self, change: Change, log: Log) -> None:
        if change.fate is Fate.KEPT:
            log("\n".join(f"    {line}" for line in change.difference()))

    def _links(self) -> Iterator[tuple[str, str]]:
        """What `systemctl enable` would make, where there is none to ask."""
        if not self._target.is_live:
            yield from links(self._board.name).items()

    def _commands(self, *, start: bool) -> Iterator[Words]:
        if not self._target.is_live:
            return
        yield ("systemd-sysusers", SYSTEM_USERS)
        yield ("systemd-tmpfiles", "--create", TEMPORARY_FILES)
        if self._target.has_device_manager:
            yield ("udevadm", "control", "--reload")
            matches = (f"--sysname-match={name}" for name in _OWN_NODES)
            yield ("udevadm", "trigger", "--settle", *matches)
        yield ("systemctl", "daemon-reload")
        for service in (GUARD, RUNTIME):
            now = ["--now"] if start else []
            yield ("systemctl", "enable", *now, instance(service, self._board.name))


def _would_be(change: Change) -> str:
    return {
        Fate.WRITTEN: "to be written",
        Fate.UNCHANGED: "is there already",
        Fate.KEPT: "is kept: yours differs, as shown below",
    }[change.fate]
