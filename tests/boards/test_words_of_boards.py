"""What each robot did, in its own words, from the result of its run."""

from collections.abc import Callable, Mapping
from typing import Any

import pytest
from firmware_boards.detective.definition import BOARD as DETECTIVE
from firmware_boards.tachobot.definition import BOARD as TACHOBOT
from firmware_boards.tachobot.result import NEVER_BEGAN, yaw_result

from firmware_runtime.models.motion import Motion

SETTLED = yaw_result(1.0, Motion(1.01, 0.0))
OFF = "yaw is off by 0.500 rad, expected 0.02 at most"
ON_PATH = {"off_m": 0.031, "yaw_error_rad": 0.0, "position": "tracking", "settled": True}


def said(text: Callable[[Mapping[str, Any]], str] | None, result: Mapping[str, Any]) -> str:
    assert text is not None
    return text(result)


@pytest.mark.parametrize(
    ("result", "words"),
    [
        ({**SETTLED, "settled_after_s": 3.24}, "turned to 1.01 rad and settled after 3.2 s"),
        ({**SETTLED, "settled_after_s": None}, "turned to 1.01 rad and settled"),
        (SETTLED, "turned to 1.01 rad and settled"),
        (
            yaw_result(1.0, Motion(0.5, 0.0)),
            f"turned to 0.50 rad and has not settled: {OFF}",
        ),
        (yaw_result(1.0, None), f"did not turn: {NEVER_BEGAN}"),
        (yaw_result(1.0, Motion(1.0, 0.0), has_begun=False), f"did not turn: {NEVER_BEGAN}"),
        (ON_PATH, "followed its path; at the end it was 0.03 m off"),
        (
            {**ON_PATH, "settled": False, "settled_reason": "position: safe"},
            "did not keep to its path: position: safe",
        ),
        (
            {**ON_PATH, "off_m": None, "settled": False, "settled_reason": NEVER_BEGAN},
            f"did not turn: {NEVER_BEGAN}",
        ),
    ],
)
def test_tachobot(result: dict[str, Any], words: str) -> None:
    assert said(TACHOBOT.result_text, result) == f"TachoBot {words}"


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (
            {"found": True, "stopped_m": 0.4812, "time_s": 34.52},
            "found its target 0.48 m away, after 34.5 s",
        ),
        ({"found": True}, "found its target"),
        (
            {"found": False, "stopped_m": 1.2, "time_s": 240.0},
            "did not find its target; it stopped 1.20 m away after 240.0 s",
        ),
        ({"found": False}, "did not find its target"),
    ],
)
def test_detective(result: dict[str, Any], words: str) -> None:
    assert said(DETECTIVE.result_text, result) == f"the detective robot {words}"
