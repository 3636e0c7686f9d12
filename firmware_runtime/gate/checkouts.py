"""BASE and HEAD: two folders, or revisions of the git repository here, put into worktrees.

A worktree of a revision is made in a folder of this process and taken away at the end. Where the
command is given within a folder of its repository, that folder of the worktree is meant.
"""

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from firmware_runtime.errors import ConfigError

_NO_HOOKS = ("-c", "core.hooksPath=/dev/null", "-c", "advice.detachedHead=false")
_EXPECTED = "expected a folder, or a revision of the git repository here"


@dataclass(frozen=True, slots=True)
class Checkout:
    """One version of the program; `commit` is None for a folder, whatever is in it."""

    name: str
    stated: str
    folder: Path
    commit: str | None

    @property
    def import_path(self) -> list[str]:
        """Where its packages are: in `src`, where there is one, and in the folder itself."""
        source = self.folder / "src"
        return [str(source), str(self.folder)] if source.is_dir() else [str(self.folder)]


def refused(faults: Sequence[str]) -> ConfigError:
    """The error for what is wrong with either or both, one fault as a sentence."""
    return ConfigError("gate", faults, f"gate: {faults[0]}" if len(faults) == 1 else None)


@contextmanager
def checkouts(base: str, head: str, into: Path) -> Iterator[tuple[Checkout, Checkout]]:
    """BASE and HEAD within the block. Raises ConfigError with what is wrong with either."""
    faults: list[str] = []
    commits = [_commit(name, stated, faults) for name, stated in (("BASE", base), ("HEAD", head))]
    if faults:
        raise refused(faults)
    worktrees: list[Path] = []
    try:
        yield (
            _checkout("BASE", base, commits[0], into, worktrees),
            _checkout("HEAD", head, commits[1], into, worktrees),
        )
    finally:
        for each in worktrees:
            _git("worktree", "remove", "--force", "--force", str(each))


def _commit(name: str, stated: str, faults: list[str]) -> str | None:
    """The commit that is meant; None for a folder, and for what is neither, which is a fault."""
    if Path(stated).is_dir():
        return None
    found = _git("rev-parse", "--verify", "--quiet", "--end-of-options", f"{stated}^{{commit}}")
    if found is None or found.returncode != 0:
        faults.append(f"{name} {stated}: neither a folder nor a revision; {_EXPECTED}")
        return None
    return found.stdout.strip()


def _checkout(
    name: str, stated: str, commit: str | None, into: Path, worktrees: list[Path]
) -> Checkout:
    if commit is None:
        return Checkout(name, stated, Path(stated).resolve(), None)
    worktree = into / name.lower()
    worktrees.append(worktree)
    made = _git(*_NO_HOOKS, "worktree", "add", "--detach", "--force", str(worktree), commit)
    if made is None or made.returncode != 0:
        said = made.stderr.strip().splitlines()[-1:] if made else []
        fault = f"{name} {stated}: {''.join(said) or 'git made no worktree'}; {_EXPECTED}"
        raise ConfigError.of_one("gate", fault)
    folder = worktree / _prefix()
    if not folder.is_dir():
        fault = f"{name} {stated}: it has no folder {_prefix()}, where this command was given"
        raise ConfigError.of_one("gate", fault)
    return Checkout(name, stated, folder, commit)


def _prefix() -> str:
    """Where in its repository this folder is, as git says it."""
    found = _git("rev-parse", "--show-prefix")
    return found.stdout.strip() if found is not None else ""


def _git(*words: str) -> "subprocess.CompletedProcess[str] | None":
    """What git answered; None where there is no git.

    A process group of its own: Ctrl-C is for this program, which tidies up.
    """
    try:
        return subprocess.run(  # noqa: S603 -- git, of the path the user has
            ["git", *words],  # noqa: S607
            check=False,
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
    except FileNotFoundError:
        return None
