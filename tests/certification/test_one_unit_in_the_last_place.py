"""A float that is the next one in a hundred places of a replay is found, and named."""

from random import Random

import pytest

from firmware_runtime.board.registry import load
from firmware_runtime.certification.found import finding_of
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.part_recording.of_board import part_code
from firmware_runtime.part_recording.recording import Recording, read_recording
from firmware_runtime.recording.of_board import board_of
from firmware_runtime.runs.recorded_run import recorded
from firmware_runtime.runs.session import Session
from tests.support.one_unit_off import chosen, replayed_off

TRACKING = ["controller.mode=track", "trajectory.kind=circle"]
PLACES = {"state": 20, "input": 15, "output": 15}
"""Of each of two recordings."""


@pytest.fixture(scope="module", params=[[], TRACKING], ids=["platform", "circle"])
def recording(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Recording:
    path = tmp_path_factory.mktemp("recorded") / "run.recording"
    board = load("tachobot", request.param)
    session = Session(board, VirtualClock(), doubles=True, statistics_path=None)
    with recorded(session, path, print) as ended:
        ended(session.run(4_000_000_000))
    session.close()
    return read_recording(path)


@pytest.mark.slow
@pytest.mark.parametrize("what", PLACES)
def test_every_float_that_is_one_unit_off_is_found_and_named(
    recording: Recording, what: str
) -> None:
    board = board_of(recording.header)
    code = part_code(board, recording.header.components)
    spots = chosen(recording, what, PLACES[what], Random(20261122))  # noqa: S311 -- no secret
    for spot in spots:
        comparison, off = replayed_off(recording, board, spot)
        finding = finding_of(recording, comparison, code)
        assert finding.first is not None, off
        assert not finding.is_identical
        assert (finding.first.what, finding.first.t_ns) == (what, off.at)
        assert (finding.first.name, finding.first.units_apart) == (off.full_name, 1)
