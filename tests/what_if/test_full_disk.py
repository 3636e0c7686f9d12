"""Plots that find no room leave those of before."""

import resource
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.what_if.what_if import Question, WhatIf, answer
from firmware_runtime.recording.what_if.what_if_report import what_if_page
from firmware_runtime.view.page_file import write_page
from tests.support.recorded import record


@pytest.fixture
def found(tmp_path: Path) -> WhatIf:
    """What another gain would have said in a tenth of a second."""
    recording = record(tmp_path / "run.recording", "tachobot", 0.1)
    return answer(Question(recording=str(recording), assignments=["controller.yaw.kp=0.8"]))


def test_a_page_that_finds_no_room_is_refused_and_the_old_one_stays(
    found: WhatIf, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    page.write_text("kept")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(ConfigError, match=r"page\.html"):
            write_page(what_if_page(found, "another gain"), page)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert page.read_text() == "kept"
