"""A project with folders `drivers` and `boards` of its own imports them beside our wheel."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from zipfile import ZipFile

import pytest

SAID = """
import drivers.arm
import boards.arm
from firmware_boards.tachobot.definition import BOARD
from firmware_drivers.imu import Imu

print(drivers.arm.NAME, boards.arm.NAME, Imu.__name__, type(BOARD).__name__)
"""


@pytest.mark.slow
@pytest.mark.parametrize("files", [("arm.py", "__init__.py"), ("arm.py",)])
@pytest.mark.parametrize("order", [("site", "project"), ("project", "site")])
def test_folders_of_these_names_are_the_projects_own(
    tmp_path: Path, wheel: Path, files: Sequence[str], order: Sequence[str]
) -> None:
    site, project = tmp_path / "site", tmp_path / "project"
    with ZipFile(wheel) as archive:
        archive.extractall(site)
    for folder in ("drivers", "boards"):
        (project / folder).mkdir(parents=True)
        for file in files:
            (project / folder / file).write_text(f"NAME = 'own {folder}'\n")
    path = [str(tmp_path / each) for each in order]
    program = f"import sys; sys.path[:0] = {path}{SAID}"
    done = subprocess.run(
        [sys.executable, "-P", "-c", program], capture_output=True, text=True, check=False
    )
    assert done.stdout.split("\n")[0] == "own drivers own boards Imu BoardDefinition", done.stderr


@pytest.mark.slow
def test_the_wheel_has_four_names_at_its_top(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        tops = {name.partition("/")[0] for name in archive.namelist()}
    packages = {each for each in tops if not each.endswith(".dist-info")}
    assert packages == {"firmware_runtime", "firmware_drivers", "firmware_boards", "sim_doubles"}
