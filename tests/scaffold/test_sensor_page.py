"""docs/sensor-of-your-own.md: its files make a package whose tests pass, and its commands run."""

import re
from pathlib import Path

import pytest

from tests.support.pages import files_of
from tests.support.written_package import WrittenPackage, package_of

FILES = files_of("sensor-of-your-own.md")


@pytest.fixture
def plumb(tmp_path: Path) -> WrittenPackage:
    """The package of the page."""
    return package_of(FILES, tmp_path / "plumb", tmp_path / "site")


@pytest.mark.slow
def test_its_files_make_a_package_whose_tests_pass(plumb: WrittenPackage) -> None:
    done = plumb.python("-W", "error", "-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert done.returncode == 0, done.stdout
    assert re.search(r"1[0-9] passed|2[0-9] passed", done.stdout), done.stdout


@pytest.mark.slow
@pytest.mark.real_time
def test_its_chip_is_tried_on_its_double(plumb: WrittenPackage) -> None:
    tried = plumb.command("try", "plumb", "--doubles", "--for", "0.1")
    assert (tried.returncode, tried.stderr) == (0, "")
    assert re.search(r"depth -?0\.000 m\s+water 15\.00 degC", tried.stdout), tried.stdout
