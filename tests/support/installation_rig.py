"""An installation into a directory, put together without the command line."""

from pathlib import Path

from firmware_runtime.board import registry
from firmware_runtime.host.installation.install import Installation
from firmware_runtime.host.installation.plan import PROGRAM
from firmware_runtime.host.installation.target import Target, Tree


def install(board: str, root: Path, program: str = PROGRAM) -> list[str]:
    """Install a board below a directory; return what was reported."""
    reported: list[str] = []
    target = Target(Tree(root))
    Installation(registry.load(board), target, program, "1.2.3").carry_out(
        reported.append, start=True
    )
    return reported


def files_below(root: Path) -> dict[str, bytes]:
    """Every file and link below a directory, with its content or what it leads to."""
    return {
        str(path.relative_to(root)): str(path.readlink()).encode()
        if path.is_symlink()
        else path.read_bytes()
        for path in sorted(root.rglob("*"))
        if path.is_symlink() or path.is_file()
    }
