"""Every file, folder and module of the repository that a page, unit or script names exists."""

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
TOPS = "firmware_runtime|drivers|boards|sim_doubles|benchmarks|docs|tests|systemd|examples"
PATH = re.compile(rf"(?<![\w/.-])((?:{TOPS})(?:/[\w.-]+)+)")
MODULE = re.compile(r"python -m ((?:firmware_runtime|benchmarks|tests)(?:\.\w+)+)")
PATTERNS = ("*.md", "*.yml", "*.yaml", "*.sh", "*.service", "Makefile", "pyproject.toml")
OF_A_USER = re.compile(r"/(?:test_)?(?:x|light|rover|chipname)\.py$")
"""Files that a page asks its reader to write."""


def tracked(*patterns: str) -> list[str]:
    listed = subprocess.run(
        ("git", "ls-files", *patterns), cwd=ROOT, capture_output=True, text=True, check=True
    )
    return listed.stdout.splitlines()


def texts() -> dict[str, str]:
    return {name: (ROOT / name).read_text(encoding="utf-8") for name in tracked(*PATTERNS)}


def exists(path: str, name: str) -> bool:
    """Seen from the root, or from the folder of the file that names it."""
    return (ROOT / path).exists() or (ROOT / name).parent.joinpath(path).exists()


def test_paths_that_are_named_exist() -> None:
    missing = [
        f"{name}: {path}"
        for name, text in texts().items()
        for path in (found.rstrip("./-") for found in PATH.findall(text))
        if not exists(path, name) and not OF_A_USER.search(path)
    ]
    assert missing == []


def test_modules_that_are_run_by_name_exist() -> None:
    missing = [
        f"{name}: {module}"
        for name, text in texts().items()
        for module in MODULE.findall(text)
        for place in (ROOT / module.replace(".", "/"),)
        if not (place.is_dir() or place.with_suffix(".py").exists())
    ]
    assert missing == []
