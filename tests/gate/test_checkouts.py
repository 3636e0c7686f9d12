"""BASE and HEAD: folders, revisions, and what is neither."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.gate.checkouts import checkouts
from firmware_runtime.lab.gate.contestant import modules_of


def git(folder: Path, *words: str) -> str:
    named = ["-c", "user.name=A", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
    done = subprocess.run(
        ["git", *named, *words], cwd=folder, check=True, capture_output=True, text=True
    )
    return done.stdout


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository whose first commit says 1 and whose second says 2, in a folder `robot`."""
    robot = tmp_path / "repository" / "robot"
    robot.mkdir(parents=True)
    git(robot.parent, "init", "-q", "-b", "main")
    for text in ("1", "2"):
        (robot / "version.txt").write_text(text)
        git(robot.parent, "add", ".")
        git(robot.parent, "commit", "-q", "-m", text)
    monkeypatch.chdir(robot)
    return robot.parent


@pytest.mark.slow
def test_a_revision_is_a_copy_and_the_folder_here_is_the_one_there(
    repository: Path, tmp_path: Path
) -> None:
    into = tmp_path / "into"
    into.mkdir()
    base, head = checkouts("main~1", ".", into)
    assert base.folder == into / "base"
    assert [each.name for each in base.folder.iterdir()] == ["version.txt"]
    assert (base.folder / "version.txt").read_text() == "1"
    assert base.commit == git(repository, "rev-parse", "main~1").strip()
    assert (head.folder, head.commit) == (repository / "robot", None)
    assert base.environment["PYTHONPATH"].split(":")[0] == str(base.folder)
    assert len(git(repository, "worktree", "list").splitlines()) == 1
    assert git(repository, "status", "--porcelain") == ""


@pytest.mark.slow
def test_a_revision_without_the_folder_is_refused(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    newer = repository / "newer"
    newer.mkdir()
    monkeypatch.chdir(newer)
    with pytest.raises(ConfigError, match="with this folder"):
        checkouts("main", ".", tmp_path)


def test_a_folder_with_sources_in_src_has_them_first_on_its_path(tmp_path: Path) -> None:
    (tmp_path / "src").mkdir()
    base, _ = checkouts(str(tmp_path), str(tmp_path), tmp_path)
    path = base.environment["PYTHONPATH"].split(":")
    assert path[:2] == [str(tmp_path / "src"), str(tmp_path)]


def test_modules_count_from_each_folder_that_holds_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lib/counted_here").mkdir(parents=True)
    (tmp_path / "lib/counted_here/__init__.py").touch()
    base, _ = checkouts(str(tmp_path), str(tmp_path), tmp_path)
    monkeypatch.syspath_prepend(base.path[0])
    importlib.import_module("counted_here")
    assert modules_of({Path(each) for each in base.path}) == 1
    del sys.modules["counted_here"]


def test_what_is_neither_is_refused_by_one_sentence_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError) as refused:
        checkouts("--help", "nonsense", tmp_path)
    assert [fault.split(":")[0] for fault in refused.value.faults] == [
        "BASE --help",
        "HEAD nonsense",
    ]
