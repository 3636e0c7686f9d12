"""A recorded run served without a socket: the packets go from hand to hand."""

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

from firmware_runtime.hal.served.packets import Answered, Asked, Question, encode, read_answer
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from sim_doubles.recorded.lines import Rules
from sim_doubles.recorded.service import RecordedService
from sim_doubles.recorded.stops import stops_of
from sim_doubles.recorded.traffic import Deviation, Deviations, Traffic, traffic_of


@dataclass
class Served:
    """A recording's lines; `said` has the deviations in sentences."""

    recording: Recording
    traffic: Traffic
    deviations: Deviations
    service: RecordedService
    reported: list[Deviation]
    client: int = 1
    over: list[str] = field(default_factory=list)

    def ask(self, asked: Asked, _where: str) -> Answered:
        answer = read_answer(self.service.answer(encode(Question(7, asked)), self.client))
        assert answer.number == 7
        return answer.answered


def served(
    path: Path, *, is_strict: bool = True, lines: Collection[str] = (), begin: int = 0
) -> Served:
    """Serve the recording at a path."""
    recording = read_recording(path)
    traffic = traffic_of(recording, lines, begin)
    reported: list[Deviation] = []
    deviations = Deviations(reported.append)
    rules = Rules(is_strict, stops_of(recording), deviations)
    service = RecordedService(recording.header.board, traffic, rules)
    found = Served(recording, traffic, deviations, service, reported)
    service.over = lambda: found.over.append("over")
    service.left = lambda: found.over.append("left")
    return found
