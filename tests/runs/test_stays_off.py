"""Outputs that are seen to be off have stayed so, or what was on last is reported."""

from collections.abc import Iterator
from itertools import chain, cycle, repeat

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.runs import safe_state as module
from firmware_runtime.runs.safe_state import BETWEEN, SafeState

ON = ["PCA9685 at 0x40 on i2c1: outputs 0 are on"]


class Lights:
    """Outputs of a chip that are on as they are told to be."""

    def __init__(self, seen: Iterator[list[str]]) -> None:
        self.seen = seen

    def outputs_on(self) -> list[str]:
        return next(self.seen)

    def make_safe(self) -> list[str]:
        return []


class Watching:
    """A safe-state whose board another process drives, on a clock that its waits move."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, seen: Iterator[list[str]]) -> None:
        self.now = 0
        monkeypatch.setattr(module, "monotonic_ns", lambda: self.now)
        self.safe_state = SafeState([], None, None)
        monkeypatch.setattr(self.safe_state, "_outputs", [Lights(seen)])
        monkeypatch.setattr(self.safe_state, "_is_driven", True)
        monkeypatch.setattr(self.safe_state, "_is_known", True)

    def wait(self) -> bool:
        self.now += BETWEEN
        return False

    def result(self) -> list[str]:
        return self.safe_state.stays_off(2 * SECOND, self.wait)


def test_what_is_off_only_in_the_last_look_was_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """What drives it was late by a period just then."""
    looks = 2 * SECOND // BETWEEN
    for seen in (cycle([ON, []]), chain(repeat(ON, looks), repeat([]))):
        assert Watching(monkeypatch, seen).result() == ON


def test_what_stays_off_after_it_was_on_is_off(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Watching(monkeypatch, chain([ON], repeat([]))).result() == []
