"""What is observed of a recording is what a run did: the values it sent, and its instants."""

from collections import Counter
from contextlib import closing
from pathlib import Path

import pytest

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.devs.trace import trace
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.recording.blackbox.locations import recording_beside
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.observed_run import Moment, missing_in, moments_of
from firmware_runtime.recording.replay.stretch import WHOLE, Stretch
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.layout import STEP_HISTOGRAM, STEPS
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from tests.support.recorded import every_section, record, rewrite

Message = tuple[int, str, object]
FUNCTIONS = {"output", "internal", "external", "confluent"}


def observed(path: Path, stretch: Stretch = WHOLE) -> list[Moment]:
    recording = read_recording(path)
    return list(moments_of(recording, board_of(recording.header), stretch))


def messages_of(moments: list[Moment]) -> list[Message]:
    return [(each.at, each.port, plain(each.value)) for moment in moments for each in moment.sent]


class Live:
    """What leaves every port, as it leaves."""

    def __init__(self) -> None:
        self.messages: list[Message] = []

    def listen(self, session: Session) -> None:
        trace(session.executive.simulator, self._note)

    def _note(self, at: int, port: str, value: object) -> None:
        self.messages.append((at, port, plain(value)))


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_values_are_those_that_left_their_ports(tmp_path: Path, board: str) -> None:
    live = Live()
    path = record(tmp_path / "x.recording", board, 3.0, before=live.listen)
    moments = observed(path)
    assert len(live.messages) > 100
    assert messages_of(moments) == live.messages
    assert all(each.begin == each.end == each.at for each in moments)
    assert missing_in(read_recording(path)) == []


@pytest.mark.slow
@pytest.mark.real_time
def test_in_real_time_instants_follow_one_another_and_add_up_to_what_was_counted(
    tmp_path: Path,
) -> None:
    path, live = tmp_path / "tachobot.stats", Live()
    board = board_in_force("tachobot", ("executive.fifo_priority=0", "recording.minutes=0.1"))
    recording = recording_beside(path)
    session = start_session(
        board, MonotonicClock(), doubles=True, statistics_path=path, recording=recording
    )
    with closing(session):
        live.listen(session)
        session.run(SECOND)
    moments, counted = observed(recording), read_statistics(path)
    assert messages_of(moments) == live.messages
    own: Counter[str] = Counter()
    for moment in moments:
        laps = [at for each in moment.ran for at in (each.begin, each.end)]
        assert [moment.begin, *laps, moment.end] == sorted([moment.begin, *laps, moment.end])
        assert {each.function for each in moment.ran} <= FUNCTIONS
        for each in moment.ran:
            own[each.model] += each.end - each.begin
    steps = [each for each in moments if each.is_step]
    assert len(steps) == counted.cells[STEPS]
    assert sum(each.end - each.begin for each in steps) == _sum(counted, STEP_HISTOGRAM)
    events = [n for n, each in counted.header.models.items() if each.period_ns is None]
    assert len(events) > 3
    for model in events:
        place = counted.layout.step(counted.layout.models.index(model))
        assert own[model] == _sum(counted, place), model


def _sum(counted: Statistics, place: slice) -> int:
    return Histogram(counted.cells[place]).sum


@pytest.mark.slow
def test_only_what_lies_in_a_stretch_is_observed(tmp_path: Path) -> None:
    path = record(tmp_path / "x.recording", "tachobot", 8.0)
    part = observed(path, Stretch(7 * SECOND, 7 * SECOND + 50 * MILLISECOND))
    assert [each.at for each in part if each.is_step] == [
        7 * SECOND + number * 10 * MILLISECOND for number in range(6)
    ]
    assert all(each.ran for each in part if each.is_step)


def test_where_the_replay_is_another_run_values_are_the_recorded_ones(tmp_path: Path) -> None:
    live = Live()
    path = record(tmp_path / "x.recording", "tachobot", 1.0, before=live.listen)
    other = board_in_force("tachobot", ("controller.yaw.kp=0.5",))
    moments = list(moments_of(read_recording(path), other))
    assert messages_of(moments) == live.messages


@pytest.mark.slow
def test_what_has_been_written_over_is_said(tmp_path: Path) -> None:
    path = record(tmp_path / "x.recording", "tachobot", 6.0)
    sections = every_section(path)
    keyframes = [n for n, each in enumerate(sections) if kind_of(each) == Kind.KEYFRAME]
    rewrite(path, sections[keyframes[-1] :], number=2)
    (said,) = missing_in(read_recording(path))
    first = observed(path)[0].at
    assert first > SECOND
    assert said.startswith("the run before ")
    assert said.endswith(" s has been written over")
    assert missing_in(read_recording(path), first) == []
