"""No hint names a package that cannot be installed: the project itself is on no index."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

from firmware_runtime.extras import install_command

ROOT = Path(__file__).parents[2]
FOLDERS = ("boards", "benchmarks", "docs", "drivers", "firmware_runtime", "sim_doubles", "tests")
FROM_AN_INDEX = re.compile(r"install (?:[^\n]*[ '\"])?firmware-runtime\[")


def test_no_text_installs_the_project_from_an_index() -> None:
    texts = [ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "Makefile"]
    texts += [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.[mp][dy]")]
    reported = [path for path in texts if FROM_AN_INDEX.search(path.read_text(encoding="utf-8"))]
    assert reported == []


def test_what_tests_and_benches_take_is_no_extra_of_an_installed_robot() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert set(project["project"]["optional-dependencies"]) == {
        "metrics",
        "gpio",
        "top",
        "plot",
        "tuning",
        "sweep",
        "mcap",
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
        ("metrics", "prometheus-client"),
    ],
)
def test_an_extra_is_installed_by_what_it_lists(extra: str, package: str) -> None:
    command = install_command(extra)
    assert command.startswith(f"{sys.executable} -m pip install '{package}>=")
    assert "firmware-runtime" not in command.removeprefix(sys.executable)
