"""docs/testing.md: its ten lines pass, and its workflow's commands are commands."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.pytest_in_a_folder import run_pytest

PAGE = Path(__file__).parents[2] / "docs" / "testing.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"(?ms)^```{language}\n(.*?)^```", PAGE.read_text("utf-8"))


@pytest.mark.slow
def test_the_ten_lines_pass(tmp_path: Path) -> None:
    lines = blocks("python")[0]
    assert len(lines.splitlines()) == 10
    (tmp_path / "test_ten_lines.py").write_text(lines)
    done = run_pytest(tmp_path, "-W", "error")
    assert (done.returncode, done.stdout.splitlines()[-1][:9]) == (0, "1 passed ")


@pytest.mark.slow
def test_what_it_says_without_pytest_prints_the_prescaler(
    capsys: pytest.CaptureFixture[str],
) -> None:
    exec(compile(blocks("python")[2], str(PAGE), "exec"), {})  # noqa: S102 -- the page's own
    assert capsys.readouterr().out == "30\n"


@pytest.mark.slow
def test_the_workflows_runs_end_well(tmp_path: Path) -> None:
    commands = re.findall(r"- run: (firmware-runtime .*)", blocks("yaml")[0])
    assert len(commands) == 3
    for command in commands:
        _, *arguments = shlex.split(command.replace("--for 60", "--for 1"))
        subprocess.run(
            [Path(sys.executable).with_name("firmware-runtime"), *arguments],
            cwd=tmp_path,
            capture_output=True,
            check=True,
        )
    assert (tmp_path / "timing.html").stat().st_size > 10_000
