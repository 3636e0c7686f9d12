"""No hint names a package that cannot be installed: the project itself is on no index."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from firmware_runtime.system.packages import install_command

ROOT = Path(__file__).parents[2]
BY_NAME = re.compile(
    r"""pip3?\s+(?:install|download)\b[^\n#&|,`]*?\s['"]?firmware[-_]runtime(?![\w./-])"""
    r"""|^(?:dependencies|requires)\b[^\n]*['"]firmware[-_]runtime\b""",
    re.MULTILINE,
)


def test_the_pattern_finds_an_installation_by_name_and_no_other() -> None:
    for text in (
        "pip install firmware-runtime",
        "python -m pip install --upgrade 'firmware-runtime[top]' pytest",
        'dependencies = ["firmware-runtime"]',
        'dependencies = ["numpy", "firmware_runtime>=0.1"]',
    ):
        assert BY_NAME.search(text), text
    for text in (
        "pip install /srv/firmware-runtime",
        "pip install wheels/firmware_runtime-*.whl pytest .",
        "pip install pytest  # beside firmware-runtime",
        "pip install .",
    ):
        assert not BY_NAME.search(text), text


def test_no_page_program_workflow_or_generated_file_installs_it_by_its_name() -> None:
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    endings = {".md", ".py", ".toml", ".yml", ".yaml", ".sh", ".txt", ".cfg", ".service"}
    found = [
        name
        for name in listed.stdout.splitlines()
        if Path(name).suffix in endings
        and Path(name) != Path(__file__).relative_to(ROOT)
        and (ROOT / name).is_file()
        and BY_NAME.search((ROOT / name).read_text(encoding="utf-8"))
    ]
    assert found == []


def test_what_tests_and_benches_take_is_no_extra_of_an_installed_robot() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert set(project["project"]["optional-dependencies"]) == {
        "metrics",
        "gpio",
        "top",
        "completion",
        "plot",
        "tuning",
        "sweep",
        "mcap",
        "pandas",
        "ros",
    }
    assert set(project["dependency-groups"]) == {"test", "bench"}
    assert {"include-group": "bench"} in project["dependency-groups"]["test"]


@pytest.mark.parametrize(
    ("extra", "package"),
    [
        ("plot", "resvg-py"),
        ("sweep", "distributed"),
        ("gpio", "gpiod"),
        ("top", "rich"),
        ("completion", "argcomplete"),
        ("metrics", "prometheus-client"),
    ],
)
def test_an_extra_is_installed_by_what_it_lists(extra: str, package: str) -> None:
    command = install_command(extra)
    assert command.startswith(f"{sys.executable} -m pip install '{package}>=")
    assert "firmware-runtime" not in command.removeprefix(sys.executable)
