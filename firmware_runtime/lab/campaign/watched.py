"""A robot that is looked at from outside: its outputs and the truth of its world, every 20 ms.

Nothing of what the robot says of itself is in a look. Faults that its models report, and values at
its ports that are not finite, are kept beside the looks.
"""

import re
from collections import deque
from collections.abc import Collection, Sequence
from enum import Enum
from functools import partial
from hashlib import blake2b
from itertools import takewhile
from math import inf, isfinite
from typing import Final, get_args, get_type_hints

from msgspec import Struct

from firmware_runtime.board.rig import Rig
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import ports_below
from firmware_runtime.devs.finite import all_numbers
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import Check, OutPort
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.fault_log import CountedFault
from firmware_runtime.executive.outcome import Device, Outcome
from firmware_runtime.hal.strike import Breakable, Kind, Place
from firmware_runtime.hal.wire_errors import WARNING, Fault
from firmware_runtime.lab.campaign.asked import Asked, Oracle
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.runs.open_board import OpenBoard
from firmware_runtime.runs.session import quitting_is_a_bug

EVERY: Final = 20 * MILLISECOND
SENT: Final = 3
"""So many messages of a port are remembered, the last ones."""


class Look(Struct, frozen=True):
    """How a robot stood at an instant."""

    at: int
    is_on: bool
    """Whether outputs were on, or moved something where the rig says that."""
    numbers: tuple[float, ...]
    """The numbers of the world's truth."""


class Said(Struct, frozen=True):
    """A fault that a model has reported."""

    model: str
    kind: str
    at: int
    sentence: str

    @classmethod
    def of(cls, counted: CountedFault, at: int) -> "Said":
        """Return what was counted, as it was said at an instant."""
        return cls(counted.path, counted.kind, at, counted.sentence)


class Lasting:
    """For how long something has been so, to be asked look by look."""

    def __init__(self) -> None:
        self.since: int | None = None
        """Since when, ns of the run; None where it was not at the last look."""

    def span(self, at: int, *, is_so: bool) -> int:
        """Ns since it first was so, and has been at each look; 0 where it is not."""
        if not is_so:
            self.since = None
        elif self.since is None:
            self.since = at
        return 0 if self.since is None else at - self.since


class Watched:
    """A robot that goes on look by look; `outcome` is there once its run is over.

    It raises ConfigError for a rig that raises, or whose truth is not the same finite numbers at
    each look.
    """

    def __init__(
        self,
        robot: OpenBoard,
        exempt: frozenset[str] = frozenset(),
        oracle: Oracle | None = None,
    ) -> None:
        rig = robot.rig
        assert rig is not None  # noqa: S101 -- it is on doubles of this process
        self.robot = robot
        self.rig: Rig = rig
        self.session = robot.session
        self.at = 0
        self.outcome: Outcome | None = None
        self.not_finite: dict[str, int] = {}
        """Ports that have sent a number that is not finite, each with the instant."""
        self.lines = {
            name: line
            for lines in (rig.buses, rig.ports)
            for name, line in lines.items()
            if isinstance(line, Breakable)
        }
        self.asked = Asked(rig, robot.board, oracle)
        self._levels: tuple[float, ...] = ()
        self._levels_since = 0
        self.reached: set[str] = set()
        """Arrows that its state diagrams have taken, `MODEL: STATE -> STATE`."""
        self.arrows: set[str] = set()
        """All that they have."""
        self._digest = blake2b(digest_size=6)
        self._sent: dict[OutPort[object], deque[int]] = {}
        """When ports of devices' models have sent, the last times."""
        self._given: dict[str, int] = {}
        """When fields that may be None were not, of values that they have sent, the last time."""
        simulator = self.session.executive.simulator
        for port in ports_below(simulator.root).values():
            if _is_of_faults(port.type):
                continue
            is_of_device = isinstance(port.owner, Device)
            if port.path not in self.asked.ports and port.path not in exempt:
                are_sound = _is_measured if is_of_device else isfinite
                simulator.listen(port, partial(self._check, port.path, are_sound))
            if is_of_device and not _says_how_it_stands(port.type):
                self._sent[port] = deque(maxlen=SENT)
                simulator.listen(port, partial(_note, self._sent[port]))
                if optional := _optional_fields(port.type):
                    simulator.listen(port, partial(self._note_given, port.path, optional))
        self._devices = [each for each in simulator.atomics if isinstance(each, Device)]
        for model in simulator.atomics:
            if isinstance(model, StateDiagram):
                self._follow(model)

    @property
    def models(self) -> list[str]:
        """Paths of all models below the root."""
        return [below_root(each.path) for each in self.session.executive.simulator.atomics]

    def look(self) -> Look:
        """Look at it now."""
        numbers, is_on = self.asked.numbers(), self.asked.is_driven
        self._digest.update(repr((is_on, numbers)).encode())
        return Look(self.at, is_on, numbers)

    def is_driven_beside(self, chips: Collection[str]) -> bool:
        """Return whether it is driven now, and by another chip than these."""
        on = (chip for chip, count in self.asked.outputs.items() if count)
        return self.asked.is_driven and any(chip not in chips for chip in on)

    def held_for(self, look: Look) -> int:
        """Ns since an output changed, or went on; 0 where each is off, or on with all it has.

        A control that is at its limits stands there for as long as it takes. To be asked at each
        look, and of that one.
        """
        levels: tuple[float, ...] = ()
        if look.is_on:
            levels = self.asked.levels(self.session.hardware.world_now())
        if levels != self._levels or all(level.is_integer() for level in levels):
            self._levels, self._levels_since = levels, self.at
        return self.at - self._levels_since

    def go_on(self, to: int | None = None) -> Look:
        """Run to the next look, or to an instant, and look."""
        self.at = self.at + EVERY if to is None else to
        if self.outcome is None:
            try:
                with quitting_is_a_bug(self.session.robot.model):
                    outcome = self.session.run_on(self.at)
            except ModelError as error:
                outcome = Outcome.of_error(error)
            if self.session.executive.is_over:
                self.outcome = outcome
        return self.look()

    def said(self, since: int, model: str | None = None) -> Said | None:
        """Return the first fault that was reported since an instant, by a model with that path.

        None if there is none.
        """
        found = [
            Said.of(each, each.first_at if each.first_at >= since else each.last_at)
            for each in self.session.executive.faults.counted
            if each.last_at >= since and model in {None, each.path}
        ]
        return min(found, key=lambda each: each.at, default=None)

    def said_wrongly(self, warned: Collection[str]) -> Said | None:
        """Return the first fault reported, if all is well; models that warn rightly may warn."""
        found = [
            Said.of(each, each.first_at)
            for each in self.session.executive.faults.counted
            if each.kind != WARNING or each.path not in warned
        ]
        return min(found, key=lambda each: each.at, default=None)

    def sends_on(self, device: str, since: int) -> str | None:
        """Return the path of a port of a device's model that has sent SENT times since then."""
        for port, sent in self._sent.items():
            if port.owner.name == device and len(sent) == SENT and sent[0] > since:
                return port.path
        return None

    def sent_last(self, device: str) -> int | None:
        """Return when any port of a device's model has sent a value last; None before it has."""
        sent = (sent[-1] for port, sent in self._sent.items() if port.owner.name == device and sent)
        return max(sent, default=None)

    def last_sent(self) -> dict[str, int]:
        """Return when ports of devices' models that measure have sent last, by path; ns.

        A field of a value that may be None counts as a port of its own.
        """
        sent = {port.path: sent[-1] for port, sent in self._sent.items() if sent}
        return {**sent, **self._given}

    def unready(self) -> dict[str, str]:
        """Return why devices speak against arming, by model."""
        why = {below_root(each.path): each.unready() for each in self._devices}
        return {path: reason for path, reason in why.items() if reason is not None}

    def has_named(self, place: Place, since: int) -> bool:
        """Return whether a fault that was reported since then is of a device, or a line, or on it.

        Its model has the same name, or the sentence has its name, its address, or that of its line.
        """
        mark = place.line if place.address is None else f"0x{place.address:02x}"
        name = re.compile(rf"\b{re.escape(place.name)}\b")
        return any(
            place.name in each.path or mark in each.sentence or name.search(each.sentence)
            for each in self.session.executive.faults.counted
            if each.last_at >= since
        )

    def said_last(self, model: str | None = None) -> Said | None:
        """Return the fault that was reported last, by a model with that path; None without any."""
        counted = self.session.executive.faults.counted
        found = [Said.of(each, each.last_at) for each in counted if model in {None, each.path}]
        return max(found, key=lambda each: each.at, default=None)

    def shown_at(self, place: Place, kind: Kind, since: int) -> int | None:
        """Return when a fault of a kind that fails, made at an instant, first showed; None before.

        On a bus that is with the first use; a port shows it when it begins, as devices on it may
        send by themselves.
        """
        line = self.lines[place.line]
        if place.line in self.rig.ports:
            return None if line.struck_at is None else max(since, line.struck_at)
        uses = takewhile(lambda use: use.at >= since, line.uses())
        shown = [
            use.at
            for use in uses
            if (place.is_line or use.address == place.address) and use.shows(kind)
        ]
        return shown[-1] if shown else None

    @property
    def struck_at(self) -> int | None:
        """The instant at which a fault first showed on a line; None before."""
        found = [each.struck_at for each in self.lines.values()]
        return min((each for each in found if each is not None), default=None)

    @property
    def digest(self) -> str:
        """A fingerprint of all looks so far, and of the faults that were reported, to the bit."""
        whole = self._digest.copy()
        counted = self.session.executive.faults.counted
        whole.update(repr([(each.path, each.kind, each.count) for each in counted]).encode())
        return whole.hexdigest()

    def _follow(self, diagram: StateDiagram) -> None:
        """Note the arrows that a state diagram takes, beside what watches it already."""
        path, before, also = below_root(diagram.path), diagram.phase, diagram.watch

        def enter(state: str) -> None:
            nonlocal before
            self.reached |= self.arrows & {f"{path}: {before} -> {state}"}
            before = state
            if also is not None:
                also(state)

        diagram.watch = enter
        self.arrows |= {
            f"{path}: {state.name} -> {arrow.to}"
            for state in diagram.states
            for arrow in (*state.external, *state.internal)
        }

    def _note_given(self, path: str, fields: Sequence[str], at: int, value: object) -> None:
        for field in fields:
            if getattr(value, field) is not None:
                self._given[f"{path}.{field}"] = at

    def _check(self, path: str, are_sound: Check, at: int, value: object) -> None:
        try:
            is_finite = all_numbers(value, are_sound)
        except (TypeError, OverflowError):  # of a type that has no numbers to look at
            return
        if not is_finite:
            self.not_finite.setdefault(path, at)


def _is_measured(value: float) -> bool:
    """Return whether a device may send it: infinity says that nothing is in its range."""
    return value > -inf


def _says_how_it_stands(kind: object) -> bool:
    """Return whether a value is no measurement, but sent when something has changed."""
    return isinstance(kind, type) and issubclass(kind, bool | Enum)


def _optional_fields(kind: object) -> list[str]:
    """Return the fields of a type of values that may be None."""
    try:
        hints = get_type_hints(kind)
    except (TypeError, NameError):  # it has no fields, or says what they are where nobody knows it
        return []
    return [name for name, hint in hints.items() if type(None) in get_args(hint)]


def _note(sent: deque[int], at: int, _value: object) -> None:
    sent.append(at)


def _is_of_faults(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, Fault)
