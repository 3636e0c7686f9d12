"""A run takes the same steps whether it is recorded or not."""

from pathlib import Path

import pytest

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.start import start_session


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_each_model_is_activated_as_often(tmp_path: Path, board: str) -> None:
    def activations(recording: Path | None) -> dict[str, tuple[int, int]]:
        session = start_session(
            board_in_force(board, ()),
            VirtualClock(),
            doubles=True,
            statistics_path=None,
            recording=recording,
        )
        try:
            session.run(3 * SECOND)
        finally:
            session.close()
        figures = session.executive.statistics.figures()
        return {name: (each.run, each.reactions) for name, each in figures.models.items()}

    bare = activations(None)
    assert bare == activations(tmp_path / "run.recording")
    assert sum(run + reactions for run, reactions in bare.values()) > 100
