"""The player of an open loop: other code or settings, on what entered then.

What the changed robot says cannot change what enters. It makes the recorded steps where it has
something to do, and those of its own that were not recorded as they come due.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from typing import Any, Final

import msgspec

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.ports import Sent
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import Section
from firmware_runtime.recording.replay.difference import NOTHING, Difference
from firmware_runtime.recording.replay.feed import Feed, OpenFeed
from firmware_runtime.recording.replay.outputs import Outputs
from firmware_runtime.recording.replay.player import Player
from firmware_runtime.recording.replay.section_comparison import Aligned, ComparedValues, Pairs

OWN_STEPS: Final = 100_000
"""Steps between two recorded ones after which the changed code is said to be stuck."""


@dataclass(frozen=True, slots=True)
class Change:
    """Change that is tried on a recording.

    Of a keyframe, what the robot had changed since it was built is taken up, and what a changed
    setting or line of code has made otherwise stays so.
    """

    board: Board
    """By the settings that are tried."""
    recorded: Board
    """By those of the run."""


class _OpenValues(ComparedValues):
    """Compares port by port: changed code may send in another order, or not at all."""

    def __init__(self, ports: Sequence[str], played: frozenset[int], outputs: Outputs) -> None:
        super().__init__(ports, played)
        self._outputs = outputs
        self._world = {self.name(number).rpartition(".")[0] for number in played}

    def differences(self, section: Section, sent: Sent) -> Iterator[Difference]:
        """Values of the robot's own that are not the recorded ones, in order."""
        found = super().differences(section, sent)
        return (each for each in found if each.model not in self._world)

    def _are_all_same(self, numbers: Sequence[int]) -> bool:
        if not self._outputs.draws:
            self._outputs.same(map(self.name, numbers))
        return not self._outputs.draws

    def _aligned(self, recorded: Pairs, replayed: Pairs) -> Aligned:
        by_port: dict[int, tuple[list[int], list[int]]] = {}
        for side, sent in enumerate((recorded, replayed)):
            for place, (number, _) in enumerate(sent):
                by_port.setdefault(number, ([], []))[side].append(place)
        return chain.from_iterable(zip_longest(*places) for places in by_port.values())

    def _is_same(self, at: int, was: Any, now: Any, value: object) -> bool:  # noqa: ANN401 -- pairs
        number = (was or now)[0]
        if number in self.played:
            return super()._is_same(at, was, now, value)
        if was is None or now is None:
            self._outputs.missing(self.name(number), at, replayed=was is None)
            return False
        is_same = super()._is_same(at, was, now, value)
        form = was[1] if is_same else now[1]  # a set has another order in each process
        self._outputs.compare(self.name(number), at, was[1], form)
        return is_same


class OpenPlayer(Player):
    """`outputs` collects what differs, `structure` counts what is not a matter of values."""

    def __init__(
        self,
        header: Header,
        change: Change,
        found: Outputs,
        structure: Counter[str],
        beginning: Section,
    ) -> None:
        self.outputs = found
        self.structure = structure
        self._change = change
        super().__init__(header, change.board, beginning)

    @property
    def is_over(self) -> bool:
        """Return whether the changed code has failed."""
        return self.failure is not None

    def went_on(self) -> None:
        """What a changed robot raises is no difference of how the run ended."""

    def _new_feed(self) -> Feed:
        return OpenFeed(self.header, self._note)

    def _new_values(self, played: frozenset[int]) -> ComparedValues:
        return _OpenValues(self.ports, played, self.outputs)

    def _compare_state(self, section: Section) -> None:
        """A changed robot has another state."""

    def _probe(self, _section: Section) -> None:
        """A chip that was not there then does not end it: its driver has faults, as on a robot."""
        try:
            self.robot.find_chips()
        except HalError:
            self.structure["chips of which nothing was recorded"] += 1

    def _reach(self, section: Section) -> bool:
        """Make the steps that come before; return whether there is something to do in this one."""
        own, simulator = 0, self.simulator
        while simulator.next_at < section.at and self.failure is None and own < OWN_STEPS:
            own += 1
            self._own_step(simulator.next_at)
        if own >= OWN_STEPS:
            due = simulator.next_at
            self.failure = RuntimeError(f"{OWN_STEPS} steps of its own before {section.at} ns")
            self._note(Difference(section.at, "step", "", "next event", section.at, due))
        if self.failure is not None:
            return False
        if own:
            self.feed.load(section)
        is_due = bool(section.entered) or simulator.next_at == section.at
        if not is_due:
            self._note(Difference(section.at, "step", "", "step", "recorded", NOTHING))
        return is_due

    def _own_step(self, at: int) -> None:
        """A step of the changed robot that was not recorded."""
        self._note(Difference(at, "step", "", "step", NOTHING, "made"))
        assert isinstance(self.feed, OpenFeed)  # noqa: S101 -- as `_new_feed` has made it
        self.feed.load_nothing(at)
        step = self.profiler.step
        step.begin(at)
        try:
            self.simulator.advance(at)
        except Exception as error:  # noqa: BLE001 -- the changed code's; what came before stands
            self.failure = error
        finally:
            self._commit()
        for number in self._sent[::2]:
            if number not in self.values.played:
                self.outputs.missing(self.ports[number], at, replayed=True)
        self._sent.clear()

    def _in_force(self, settings: object) -> object:
        began, wished = self._change.recorded, self._change.board
        return _carried(settings, began.settings, wished.settings)

    # What is compared -----------------------------------------------------------------------------

    def _compare_sent(self, section: Section) -> None:
        super()._compare_sent(section)
        self._compare_writes(section)

    def _compare_writes(self, section: Section) -> None:
        """Compare what was read from each device and written to it."""
        assert isinstance(self.feed, OpenFeed)  # noqa: S101 -- as `_new_feed` has made it
        if section.transfers == [] and self.feed.asked == []:
            return
        by_device: dict[tuple[int, int], tuple[list[object], list[object]]] = {}
        for side, transfers in enumerate((section.transfers, self.feed.asked)):
            for each in transfers:
                device = each.line, each.address
                by_device.setdefault(device, ([], []))[side].append(each.messages)
        for (line, address), (were, are) in by_device.items():
            name = self.feed.device(line, address)
            self.outputs.compare_writes(name, section.at, were, are)  # the feed has reported them

    def _report(self) -> None:
        for each in self._noted:
            if (word := _structural(each)) is not None:
                self.structure[word] += 1
        super()._report()


def _structural(difference: Difference) -> str | None:
    """Name a difference that is not a matter of values; None for one that is."""
    is_new = difference.recorded == NOTHING
    is_gone = difference.replayed == NOTHING
    words = {"step": "steps", "write": "transfers", "value": "values", "asked": "readings"}
    if difference.what not in words or not (is_new or is_gone):
        return None
    return f"{words[difference.what]} {'that were not recorded' if is_new else 'no longer made'}"


def _carried(given: object, recorded: object, wished: object) -> object:
    """Settings that a run took up, but for those that are tried otherwise than it began."""
    if isinstance(given, msgspec.Struct) and type(given) is type(recorded) is type(wished):
        return msgspec.structs.replace(
            given,
            **{
                name: _carried(*(getattr(each, name) for each in (given, recorded, wished)))
                for name in given.__struct_fields__
            },
        )
    if isinstance(given, dict) and isinstance(recorded, dict) and isinstance(wished, dict):
        keys = [key for key in given if key in recorded and key in wished]
        return given | {key: _carried(given[key], recorded[key], wished[key]) for key in keys}
    return given if recorded == wished else wished
