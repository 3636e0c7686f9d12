"""The conditions of a run say which doubles it is on."""

import pytest

from firmware_runtime.board import registry
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.hardware import Hardware


@pytest.mark.parametrize(("is_here", "said"), [(True, True), (False, None)])
def test_doubles_in_the_run_itself_are_said_where_they_are(
    *, is_here: bool, said: bool | None
) -> None:
    board = registry.load("tachobot")
    hardware = Hardware(board, VirtualClock(), True, lambda: False, is_here=is_here)
    assert hardware.conditions(None).get("doubles") is said
    hardware.close()
