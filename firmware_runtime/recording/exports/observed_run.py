"""A recorded run, observed as it is run again: what ran when, and what left which port.

Instants are the clock's readings within a step, which a recording has in order: a step begins with
the first and ends with the last, a model's function ends with the one that was read behind it and
begins where the one before it ended. In virtual time there are none, and all are the step's.
Collections of garbage are not among them.

Values are those that the models sent again. Where these are not the recorded ones, as where a model
reads a clock of its own, they are the recorded ones, by the types of their ports.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import NamedTuple

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.functions import FUNCTIONS
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.account import Step
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.blackbox.section import Kind, Section
from firmware_runtime.recording.blackbox.taps import output_ports
from firmware_runtime.recording.exports.typed_values import Port, Sent, values_in
from firmware_runtime.recording.replay.player import Player
from firmware_runtime.recording.replay.stretch import WHOLE, Stretch, plays_of


class Ran(NamedTuple):
    """A function of a model that ran, from and to an instant of the run, ns."""

    model: str
    function: str
    begin: int
    end: int


class Moment(NamedTuple):
    """Observation of a run at an instant `at`, ns; `is_step`, or else between two steps."""

    at: int
    begin: int
    end: int
    ran: list[Ran]
    sent: list[Sent]
    is_step: bool = True


def moments_of(recording: Recording, board: Board, stretch: Stretch = WHOLE) -> Iterator[Moment]:
    """Run a stretch of it again; what came before its first keyframe is left out.

    Raises ConfigError for a recording that has nothing to begin with, or is none of this board.
    """
    for player, sections in plays_of(recording, partial(Player, recording.header, board), stretch):
        yield from _moments(player, sections, stretch.begin)


def missing_in(recording: Recording, begin: int = 0) -> list[str]:
    """Return what of the run from an instant on cannot be observed, one sentence each."""
    faults = recording.faults()
    first = next((each.first_at for each in recording.segments()), 0)
    if first > begin and not recording.is_from_start:
        faults.insert(0, f"the run before {first / SECOND:.3f} s has been written over")
    return faults


class Observer:
    """Observes what a player does, section by section."""

    def __init__(self, player: Player) -> None:
        self.player = player
        self.atomics = {below_root(each.path): each for each in player.simulator.atomics}
        self._paths = list(self.atomics)
        self._ports = {
            below_root(port.path): port for port in output_ports(player.simulator.atomics)
        }

    def take(self, section: Section) -> Moment | None:
        """Let it take a section; return what was to be seen, None of one without an instant."""
        player = self.player
        found = player.differences
        player.take(section)
        if not section.has_instant:
            return None
        is_recorded = player.differences == found
        sent = _sent(player, section) if is_recorded else _recorded(player, section, self._ports)
        ran = _ran(player.profiler.step, self._paths) if section.kind is Kind.STEP else []
        return _moment(section, ran, sent)


def _moments(player: Player, sections: Iterator[Section], begin: int) -> Iterator[Moment]:
    observer = Observer(player)
    for section in sections:
        moment = observer.take(section)
        if moment is not None and moment.at >= begin:
            yield moment


def _ran(step: Step, paths: Sequence[str]) -> list[Ran]:
    """The functions of models that were called in the step that is over, in order."""
    ran, begin, each = list[Ran](), step.started, iter(step.laps.noted)
    for number, function, reading, _ in zip(each, each, each, each, strict=True):
        end = reading - step.epoch
        ran.append(Ran(paths[number], FUNCTIONS[function], begin, end))
        begin = end
    return ran


def _sent(player: Player, section: Section) -> list[Sent]:
    return [Sent(section.at, player.ports[number], value) for number, value in player.sent]


def _recorded(player: Player, section: Section, ports: dict[str, Port]) -> list[Sent]:
    return list(values_in(section, player.header.ports, ports))


def _moment(section: Section, ran: list[Ran], sent: list[Sent]) -> Moment:
    readings = section.readings or [section.at]
    return Moment(section.at, readings[0], readings[-1], ran, sent, section.kind is Kind.STEP)
