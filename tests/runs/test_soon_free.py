"""A board that is run again at once waits a moment for the lines of the run before."""

import pytest

from firmware_runtime.hal.wire_errors import BusInUse
from firmware_runtime.runs.open_lines import soon_free
from firmware_runtime.system import resources


def test_what_another_process_lets_go_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []
    monkeypatch.setattr(resources, "sleep", waits.append)
    monkeypatch.setattr(resources, "monotonic", lambda: sum(waits))
    attempts = iter([BusInUse("i2c1"), BusInUse("i2c1"), None])

    def take() -> str:
        if (error := next(attempts)) is not None:
            raise error
        return "the bus"

    assert soon_free(take) == "the bus"
    assert len(waits) == 2


def test_what_it_keeps_is_refused_after_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []
    monkeypatch.setattr(resources, "sleep", waits.append)
    monkeypatch.setattr(resources, "monotonic", lambda: sum(waits))

    def take() -> str:
        raise BusInUse("i2c1: /dev/i2c-1 is driven by another process")

    with pytest.raises(BusInUse, match="another process"):
        soon_free(take)
    assert 1.0 <= sum(waits) < 1.1
