"""A short run of the bench has a line for each board, and the shares come last."""

import json

import pytest

from benchmarks.prediction import bench
from firmware_runtime.cli.main import main


@pytest.mark.slow
def test_boards_and_shares_are_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "prediction", "--boards", "1", "--steps", "1000", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert len(report["boards"]) == 1
    assert 0 <= report["within_twice"] <= 1
    assert all(row["ratio"] > 0 for row in report["boards"])
    assert list(bench.prediction_lines(report))[-1].startswith("and within twice: ")


def test_a_number_gives_the_same_board_each_time() -> None:
    (shipped, board), again = bench.boards(5), bench.boards(5)[1]
    assert board.assignments == again.assignments
    assert list(board.assignments)[: len(shipped.assignments)] == list(shipped.assignments)
