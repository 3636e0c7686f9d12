"""docs/actuator-of-your-own.md: its files make a package whose tests pass, its table is whole."""

import re
import shlex
from pathlib import Path

import pytest
from firmware_drivers.actuator import Actuator

from tests.support.pages import PROJECT, files_of
from tests.support.written_package import WrittenPackage, as_installed

PAGE = (PROJECT / "docs" / "actuator-of-your-own.md").read_text(encoding="utf-8")
FILES = files_of("actuator-of-your-own.md")
(COMMAND,) = re.findall(r"^```sh\nfirmware-runtime (.*?)\n```", PAGE, re.MULTILINE)


@pytest.mark.slow
def test_its_files_make_a_package_whose_tests_pass(tmp_path: Path) -> None:
    (tmp_path / "winch.toml").write_text(FILES["winch.toml"])
    written = WrittenPackage(tmp_path, tmp_path).command(*shlex.split(COMMAND))
    assert written.returncode == 0, written.stderr
    package = as_installed(tmp_path / "winch", tmp_path / "site")
    for name, text in FILES.items():
        if name.endswith(".py"):
            (package.folder / name).write_text(text)
    done = package.python("-W", "error", "-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert done.returncode == 0, done.stdout
    collected = package.python("-m", "pytest", "-q", "--collect-only", "-p", "no:cacheprovider")
    for name in ("test_winch.py", "test_haul.py", "test_cableway.py"):
        assert f"tests/{name}::" in collected.stdout


def test_the_page_names_all_that_an_actuator_asks_of_a_subclass() -> None:
    asked = [*Actuator.__abstractmethods__, "external", "resume", "poll"]
    for name in asked:
        assert f"| `{name}(" in PAGE, name
