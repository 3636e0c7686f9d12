"""A robot that is looked at from outside: its outputs and the truth of its world, every 20 ms.

Nothing of what the robot says of itself is in a look. Faults that its models report, and values at
its ports that are not finite, are kept beside the looks.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from hashlib import blake2b
from math import isfinite
from typing import Final

import msgspec
from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import (
    Driven,
    Judging,
    Losable,
    Noted,
    Purposeful,
    Rig,
    Truthful,
    Warned,
)
from firmware_runtime.board.rigs import blamed_on_rig
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import ports_below
from firmware_runtime.devs.finite import all_numbers
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.executive.outcome import Device, Outcome
from firmware_runtime.hal.strike import Breakable, Place
from firmware_runtime.hal.wire_errors import WARNING, Fault
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.runs.open_board import OpenBoard
from firmware_runtime.runs.session import quitting_is_a_bug

EVERY: Final = 20 * MILLISECOND


class Look(Struct, frozen=True):
    """How a robot stood at an instant."""

    at: int
    is_on: bool
    """Whether outputs were on, or moved something where the rig says that."""
    numbers: tuple[float, ...]
    """The numbers of the world's truth."""
    held: int = 0
    """Ns for which outputs have been on, each as it is now, and not all at an end."""


class Said(Struct, frozen=True):
    """A fault that a model has reported."""

    model: str
    kind: str
    at: int


class _Asked:
    """What a rig says of itself; whatever it raises is its package's fault, a ConfigError."""

    def __init__(self, rig: Rig, board: Board) -> None:
        self._rig = rig
        self._board = board

    def lost(self) -> str | None:
        """Return why its robot cannot go on, of a rig that knows."""
        assert isinstance(self._rig, Losable)  # noqa: S101 -- it is of one
        with blamed_on_rig(self._board, "lost"):
            return self._rig.lost()

    def judge(self) -> str | None:
        """Return what is wrong with its world, of a rig that judges."""
        assert isinstance(self._rig, Judging)  # noqa: S101 -- it is of one
        with blamed_on_rig(self._board, "judge"):
            return self._rig.judge()

    def missed(self) -> str | None:
        """Return what its robot should have done by now, of a rig that knows."""
        assert isinstance(self._rig, Purposeful)  # noqa: S101 -- it is of one
        with blamed_on_rig(self._board, "missed"):
            return self._rig.missed()


class Watched:
    """A robot that goes on look by look; `outcome` is there once its run is over.

    It raises ConfigError for a rig that raises, or whose truth is not the same finite numbers at
    each look.
    """

    def __init__(self, robot: OpenBoard, exempt: frozenset[str] = frozenset()) -> None:
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
        # asked once: to look at a protocol takes longer than to look at the robot
        self._truth = rig if isinstance(rig, Truthful) else None
        self._driven = rig if isinstance(rig, Driven) else None
        asked = _Asked(rig, robot.board)
        self.losable: Losable | None = asked if isinstance(rig, Losable) else None
        self.judging: Judging | None = asked if isinstance(rig, Judging) else None
        self.purposeful: Purposeful | None = asked if isinstance(rig, Purposeful) else None
        self._warned = tuple(rig.warned) if isinstance(rig, Warned) else ()
        """Models whose warnings are right."""
        self._noted = [
            line
            for lines in (rig.buses, rig.ports)
            for line in lines.values()
            if isinstance(line, Noted)
        ]
        self._levels: tuple[float, ...] = ()
        self._levels_since = 0
        self.reached: set[str] = set()
        """Arrows that its state diagrams have taken, `MODEL: STATE -> STATE`."""
        self.arrows: set[str] = set()
        """All that they have."""
        self._digest = blake2b(digest_size=6)
        self.names = [name for name, _ in self._numbers_now()]
        """Names of the numbers in a look."""
        simulator = self.session.executive.simulator
        truths = {name for name, _ in self._truths()}
        for port in ports_below(simulator.root).values():
            if port.path not in truths and port.path not in exempt and not _is_of_faults(port.type):
                simulator.listen(port, partial(self._check, port.path))
        self._devices = [each for each in simulator.atomics if isinstance(each, Device)]
        for model in simulator.atomics:
            if isinstance(model, StateDiagram):
                self._follow(model)

    def look(self) -> Look:
        """Look at it now."""
        found = self._numbers_now()
        with blamed_on_rig(self.robot.board, "truth"):
            if [name for name, _ in found] != self.names:
                expected = f"as at first, {', '.join(self.names)}"
                raise SettingError(", ".join(name for name, _ in found), expected=expected)
            for name, number in found:
                if not isfinite(number):
                    raise SettingError(f"{name} is {number}", expected="a finite number")
        numbers = tuple(number for _, number in found)
        is_on = self.has_output_on if self._driven is None else self._is_driven(self._driven)
        self._digest.update(repr((is_on, numbers)).encode())
        return Look(self.at, is_on, numbers, self._held(is_on=is_on))

    def _held(self, *, is_on: bool) -> int:
        """Ns since an output changed, or went on; 0 where each is off, or on with all it has.

        A control that is at its limits stands there for as long as it takes.
        """
        levels: tuple[float, ...] = ()
        if is_on:
            now = self.session.hardware.world_now()
            levels = tuple(map(float, self.rig.levels(now).values()))
        if levels != self._levels or all(level.is_integer() for level in levels):
            self._levels, self._levels_since = levels, self.at
        return self.at - self._levels_since

    @property
    def warnings(self) -> list[str]:
        """What doubles have noted: what a real chip would ignore, refuse or leave undefined."""
        return [each for line in self._noted for each in line.warnings]

    @property
    def has_output_on(self) -> bool:
        """Whether any output is on."""
        with blamed_on_rig(self.robot.board, "outputs"):
            return any(self.rig.outputs.values())

    def _is_driven(self, rig: Driven) -> bool:
        with blamed_on_rig(self.robot.board, "is_driven"):
            return rig.is_driven

    def _truths(self) -> list[tuple[str, object]]:
        """The truth of the world, by name; nothing where its rig does not say it."""
        if self._truth is None:
            return []
        with blamed_on_rig(self.robot.board, "truth"):
            return [*self._truth.truth().items()]

    def _numbers_now(self) -> list[tuple[str, float]]:
        return [each for path, value in self._truths() for each in _numbers(path, value)]

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

    def said(self, since: int) -> Said | None:
        """Return the first fault that was reported since an instant; None if there is none."""
        found = [
            Said(each.path, each.kind, each.first_at if each.first_at >= since else each.last_at)
            for each in self.session.executive.faults.counted
            if each.last_at >= since
        ]
        return min(found, key=lambda each: each.at, default=None)

    def said_wrongly(self) -> Said | None:
        """Return the first fault reported, if all is well; warnings that are right are none."""
        found = [
            Said(each.path, each.kind, each.first_at)
            for each in self.session.executive.faults.counted
            if each.kind != WARNING or each.path not in self._warned
        ]
        return min(found, key=lambda each: each.at, default=None)

    def unready(self) -> dict[str, str]:
        """Return why devices speak against arming, by model."""
        why = {below_root(each.path): each.unready() for each in self._devices}
        return {path: reason for path, reason in why.items() if reason is not None}

    def has_named(self, place: Place, since: int) -> bool:
        """Return whether a fault that was reported since then is of a device, or a line, or on it.

        Its model has the same name, or the sentence has its address, or the name of its line.
        """
        mark = place.line if place.address is None else f"0x{place.address:02x}"
        return any(
            place.name in each.path or mark in each.sentence
            for each in self.session.executive.faults.counted
            if each.last_at >= since
        )

    def said_last(self) -> Said | None:
        """Return the fault that was reported last; None if there is none."""
        counted = self.session.executive.faults.counted
        found = [Said(each.path, each.kind, each.last_at) for each in counted]
        return max(found, key=lambda each: each.at, default=None)

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
        path, before, also = below_root(diagram.path), "", diagram.watch

        def enter(state: str) -> None:
            nonlocal before
            if before:
                self.reached.add(f"{path}: {before} -> {state}")
            before = state
            if also is not None:
                also(state)

        diagram.watch = enter
        self.arrows |= {
            f"{path}: {state.name} -> {arrow.to}"
            for state in diagram.states
            for arrow in (*state.external, *state.internal)
        }

    def _check(self, path: str, at: int, value: object) -> None:
        try:
            is_finite = all_numbers(value)
        except (TypeError, OverflowError):  # of a type that has no numbers to look at
            return
        if not is_finite:
            self.not_finite.setdefault(path, at)


def _is_of_faults(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, Fault)


def _numbers(name: str, value: object) -> Iterator[tuple[str, float]]:
    """The numbers in a value, each with its name."""
    if isinstance(value, int | float):
        yield name, float(value)
    elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
        for index, each in enumerate(value):
            yield from _numbers(f"{name}.{index}", each)
    elif isinstance(value, Struct):
        for field, each in msgspec.structs.asdict(value).items():
            yield from _numbers(f"{name}.{field}", each)
