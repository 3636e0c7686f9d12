"""TachoBot's allocation with what a test puts in: another attribute, other forces."""

from collections.abc import Callable
from typing import Any

import pytest
from firmware_boards.tachobot.allocation import Allocation
from firmware_drivers.thrust_pairs import Forces


def has_attribute(
    monkeypatch: pytest.MonkeyPatch, name: str, made: Callable[[Allocation], object]
) -> None:
    """Let it have another attribute, made as it is built."""
    build: Callable[..., None] = Allocation.__init__

    def built(self: Allocation, *arguments: Any) -> None:  # noqa: ANN401 -- as they are
        build(self, *arguments)
        setattr(self, name, made(self))

    monkeypatch.setattr(Allocation, "__init__", built)


def sends(monkeypatch: pytest.MonkeyPatch, changed: Callable[[Any, float], float]) -> None:
    """Let it send other forces: `changed` gets the model and each force."""
    output = Allocation.output

    def sent(self: Allocation) -> None:
        self.forces = Forces(*(changed(self, each) for each in self.forces))
        output(self)

    monkeypatch.setattr(Allocation, "output", sent)
