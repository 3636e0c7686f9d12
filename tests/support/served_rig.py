"""Served doubles without a socket: the packets go from hand to hand, on a clock moved by hand."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from firmware_runtime.board import registry
from firmware_runtime.hal.served.packets import Answered, Asked, Question, encode, read_answer
from sim_doubles.clock import ManualClock
from sim_doubles.rigs.board_rig import DoublesRig, rig_for
from sim_doubles.served.logs import OutputLog
from sim_doubles.served.service import DoublesService

SERIAL_TREADS = (
    "treads.driver=sabertooth",
    "treads.port=treads",
    "treads.address=128",
    "treads.refresh_s=0.2",
    "treads.timeout_s=1.0",
    "ports.treads.device=/dev/no/treads",
    "ports.treads.baud=9600",
)
SERIAL_SONAR = (
    "body_sonar.chip=maxbotix",
    "body_sonar.port=sonar",
    "body_sonar.period_s=0.2",
    "ports.sonar.device=/dev/no/sonar",
    "ports.sonar.baud=9600",
)


@dataclass
class ServedRig:
    """A board's rig of doubles and its service."""

    clock: ManualClock
    doubles: DoublesRig
    service: DoublesService

    def ask(self, asked: Asked, _where: str) -> Answered:
        answer = read_answer(self.service.answer(encode(Question(7, asked))))
        assert answer.number == 7
        return answer.answered


@contextmanager
def served_rig(board: str, *assignments: str, log: Path = Path(os.devnull)) -> Iterator[ServedRig]:
    """Build one with `KEY=VALUE` overrides."""
    loaded = registry.load(board, assignments)
    clock = ManualClock()
    doubles = rig_for(loaded, clock)
    with OutputLog(log, doubles) as output_log:
        yield ServedRig(clock, doubles, DoublesService(board, doubles, clock, output_log, loaded))


def lines_of(log: Path) -> list[dict[str, Any]]:
    """What stands in a log."""
    return [json.loads(line) for line in log.read_text().splitlines()]
