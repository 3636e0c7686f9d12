"""What an installation would change in a tree, and changing it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import unified_diff
from enum import StrEnum

from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board
from firmware_runtime.host.installation.places import settings_path
from firmware_runtime.host.installation.plan import File
from firmware_runtime.host.installation.tree import Tree


class Fate(StrEnum):
    """What becomes of a file."""

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
    """What becomes of every file of a plan; nothing is written yet."""
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
