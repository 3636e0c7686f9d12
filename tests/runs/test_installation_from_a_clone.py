"""From a bare clone to installed files in two commands, as README.md and docs/service.md say."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_runtime.host.installation.places import drop_in_path, settings_path, unit_path

REPOSITORY = Path(__file__).parents[2]
NO_PACKAGES = "No matching distribution found"


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """The files that git knows or would take, and nothing that was made from them."""
    if shutil.which("git") is None or not (REPOSITORY / ".git").exists():
        pytest.skip("needs a checkout and the Debian package git")
    listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(listing, cwd=REPOSITORY, capture_output=True, text=True, check=True)
    for name in listed.stdout.rstrip("\0").split("\0"):
        source, place = REPOSITORY / name, tmp_path / "clone" / name
        if source.exists():
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, place, follow_symlinks=False)
    return tmp_path / "clone"


def not_of_another_make() -> dict[str, str]:
    """What `make suite VENV=...` hands down is not for the make of the clone."""
    handed_down = {"MAKEFLAGS", "MAKEOVERRIDES", "MFLAGS", "MAKELEVEL", "VENV", "PYTHON"}
    return {name: value for name, value in os.environ.items() if name not in handed_down}


@pytest.mark.slow
def test_two_commands_install_a_board_below_a_root(clone: Path, tmp_path: Path) -> None:
    make = ["make", ".venv/installed-run", f"PYTHON={sys.executable}"]
    made = subprocess.run(
        make, cwd=clone, env=not_of_another_make(), capture_output=True, text=True, check=False
    )
    if NO_PACKAGES in made.stderr:
        pytest.skip("needs a package index that pip can reach")
    assert made.returncode == 0, made.stderr
    root = tmp_path / "root"
    program = clone / ".venv/bin/firmware-runtime"
    words = [str(program), "service", "install", "detective", "--root", str(root)]
    ended = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    for path, shipped in (
        (settings_path("detective"), "boards/firmware_boards/detective/board.toml"),
        (unit_path("firmware-runtime"), "systemd/firmware-runtime@.service"),
        (unit_path("firmware-runtime-guard"), "systemd/firmware-runtime-guard@.service"),
    ):
        assert (root / path.lstrip("/")).read_bytes() == (clone / shipped).read_bytes()
    drop_in = root / drop_in_path("firmware-runtime", "detective").lstrip("/")
    assert "DeviceAllow=/dev/i2c-1 rw\n" in drop_in.read_text()
