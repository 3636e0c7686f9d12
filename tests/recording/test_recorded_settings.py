"""Settings that a run was recorded with, and that the code of today refuses."""

from tempfile import gettempdir

import pytest

from firmware_runtime.board import registry
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.board_of_recording import board_of_table


def test_a_key_that_the_code_no_longer_has_is_named_with_the_run_and_not_with_a_passing_file() -> (
    None
):
    board = registry.load("tachobot")
    table = {**board.table, "wings": 2}
    with pytest.raises(ConfigError) as refusal:
        board_of_table(str(board.source), table)
    assert refusal.value.where == "settings of the recorded run, by this code"
    assert refusal.value.faults[0].startswith("wings: unknown key")
    assert gettempdir() not in str(refusal.value)
