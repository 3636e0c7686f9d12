"""A board with the paper's blocks is its replay: what came from the network came at its instant."""

from pathlib import Path
from typing import Any

import pytest
from firmware_boards.tachobot.wiring import Tachobot

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.models.dover import RcvDover, SndDover
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.runs.start import start_session
from tests.support.linked_runs import free_port
from tests.support.replayed import check_identical
from tests.support.waiting import PATIENCE_S


class CountingRcv(RcvDover):
    """Counts what comes."""

    came = 0

    def external(self, elapsed: int) -> None:
        super().external(elapsed)
        self.came += 1


@pytest.mark.slow
@pytest.mark.real_time
def test_numbers_that_go_out_and_come_back_over_udp_are_replayed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    port, build = free_port(), Tachobot.__init__
    receivers: list[CountingRcv] = []

    def built(self: Any, *words: Any, **named: Any) -> None:  # noqa: ANN401
        build(self, *words, **named)
        snd = self.add(SndDover("snd", port))
        receivers.append(self.add(CountingRcv("rcv", port)))
        self.couple(_command(self.controller), snd.value)

    monkeypatch.setattr(Tachobot, "__init__", built)
    path = tmp_path / "run.recording"
    board = board_in_force("tachobot", ("executive.fifo_priority=0",))
    session = start_session(
        board, MonotonicClock(), doubles=True, statistics_path=None, recording=path
    )
    try:
        for second in range(1, PATIENCE_S):
            session.run_on(second * SECOND)
            if sum(each.came for each in receivers) > 20:
                break
    finally:
        session.close()
    check_identical(path)
    segments = read_recording(path).segments()
    entered = [pair for part in segments for each in part.sections() for pair in each.entered]
    assert len(entered) > 10
    assert len({name for name, _ in entered}) == 1
    assert len({float(text) for _, text in entered}) > 1


def _command(controller: Any) -> Any:  # noqa: ANN401 -- what the yaw controller says
    said = controller.out_port("said", float)
    controller.couple(controller.components["yaw"].out_ports["command_n"], said)
    return said
