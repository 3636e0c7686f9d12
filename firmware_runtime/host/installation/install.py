"""Installing a board as a service; once or again, the outcome is the same."""

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from difflib import unified_diff
from enum import StrEnum

from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board
from firmware_runtime.host.installation.plan import (
    GUARD,
    RUNTIME,
    SYSTEM_USERS,
    TEMPORARY_FILES,
    File,
    device_nodes,
    files_of,
    instance,
    links,
    settings_path,
)
from firmware_runtime.host.installation.target import Target, Tree, Words, run


class Fate(StrEnum):
    """Fate of a file."""

    UNCHANGED = "unchanged"
    WRITTEN = "written"
    KEPT = "kept: yours differs"


@dataclass(frozen=True, slots=True)
class Change:
    """A file and what becomes of it; `there` is what is in its place now, if anything is."""

    file: File
    fate: Fate
    there: bytes | None

    def difference(self) -> Iterator[str]:
        """From what is shipped to what is the user's, as `diff -u` prints it."""
        yours = (self.there or b"").decode(errors="replace").splitlines()
        shipped = self.file.content.splitlines()
        return unified_diff(shipped, yours, "as shipped", self.file.path, lineterm="")


def settings_in_force(board: Board, tree: Tree) -> Board:
    """The board as the user's copy of its settings has it, if there is one.

    Raises ConfigError for a copy with faults or of another board.
    """
    copy = settings_path(board.name)
    if not tree.exists(copy):
        return board
    return registry.load_copy(tree.where(copy), board.name)


def changes(plan: Sequence[File], tree: Tree) -> list[Change]:
    """Return what becomes of every file of a plan; nothing is written yet."""
    return [_change(file, tree) for file in plan]


def carry_out(change: Change, tree: Tree) -> None:
    """Write the file if that is its fate."""
    if change.fate is Fate.WRITTEN:
        tree.write(change.file.path, change.file.content.encode(), change.file.mode)


def _change(file: File, tree: Tree) -> Change:
    there = tree.content(file.path)
    if there is None:
        return Change(file, Fate.WRITTEN, there)
    is_same = there == file.content.encode()
    if file.is_users:
        return Change(file, Fate.UNCHANGED if is_same else Fate.KEPT, there)
    is_whole = is_same and tree.mode(file.path) == file.mode
    return Change(file, Fate.UNCHANGED if is_whole else Fate.WRITTEN, there)


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
        """True if anything that was there already is overwritten."""
        return any(each.fate is Fate.WRITTEN and each.there is not None for each in self._changes)

    def _show_difference(self, change: Change, log: Log) -> None:
        if change.fate is Fate.KEPT:
            log("\n".join(f"    {line}" for line in change.difference()))

    def _links(self) -> Iterator[tuple[str, str]]:
        """Return what `systemctl enable` would make, where there is none to ask."""
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
        services = [instance(each, self._board.name) for each in (GUARD, RUNTIME)]
        yield ("systemctl", "enable", "--no-reload", *services)
        yield ("systemctl", "daemon-reload")
        if start:
            yield from (("systemctl", "start", each) for each in services)


def _would_be(change: Change) -> str:
    return {
        Fate.WRITTEN: "to be written",
        Fate.UNCHANGED: "is there already",
        Fate.KEPT: "is kept: yours differs, as shown below",
    }[change.fate]
