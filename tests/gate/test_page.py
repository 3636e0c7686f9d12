"""docs/performance.md: its workflow does with each status what it says, its limits are there."""

import re
import subprocess
from dataclasses import fields
from pathlib import Path

import pytest

from sim_doubles.testing.limits import Limits

PAGE = (Path(__file__).parents[2] / "docs" / "performance.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("answer", "status", "warns"), [(0, 0, 0), (1, 1, 0), (11, 0, 1), (2, 2, 0)]
)
def test_the_workflow_warns_of_what_cannot_be_told(
    answer: int, status: int, warns: int, tmp_path: Path
) -> None:
    found = re.search(r"(?ms)^        run: \|\n(.*?)^```", PAGE)
    assert found is not None
    command = tmp_path / "firmware-runtime"
    command.write_text(f'#!/bin/sh\n[ "$*" = "gate main . my_robot" ] && exit {answer}\nexit 99\n')
    command.chmod(0o755)
    done = subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", found[1]],
        env={"PATH": f"{tmp_path}:/usr/bin:/bin", "BASE": "main"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout.count("::warning::")) == (status, warns)


def test_every_limit_is_on_the_page() -> None:
    assert [each.name for each in fields(Limits) if f"`{each.name}`" not in PAGE] == []
