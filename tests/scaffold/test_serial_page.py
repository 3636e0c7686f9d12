"""docs/serial-chip-of-your-own.md: its files make a package whose tests pass, and it is tried."""

import re
from pathlib import Path

import pytest

from tests.support.pages import files_of
from tests.support.written_package import WrittenPackage, package_of

FILES = files_of("serial-chip-of-your-own.md")


@pytest.fixture
def brook(tmp_path: Path) -> WrittenPackage:
    """The package of the page."""
    return package_of(FILES, tmp_path / "brook", tmp_path / "site")


@pytest.mark.slow
def test_its_files_make_a_package_whose_tests_pass(brook: WrittenPackage) -> None:
    done = brook.python("-W", "error", "-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert done.returncode == 0, done.stdout
    assert re.search(r"18 passed", done.stdout), done.stdout


@pytest.mark.slow
@pytest.mark.real_time
def test_its_device_is_tried_on_its_double(brook: WrittenPackage) -> None:
    tried = brook.command("try", "brook", "--doubles", "--for", "0.1")
    assert (tried.returncode, tried.stderr) == (0, "")
    assert re.search(r"flow 0\.250 l/s", tried.stdout), tried.stdout
