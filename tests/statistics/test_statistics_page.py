"""docs/statistics.md names every key of the JSON that `stats` prints."""

import re
from collections.abc import Iterator
from pathlib import Path

from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import WORST
from firmware_runtime.statistics.takeovers import Takeover
from firmware_runtime.system.conditions import system_conditions

PAGE = Path(__file__).parents[2] / "docs" / "statistics.md"
NAMES = {"imu", "thrust", "i2c1", "yaw"}
"""Of the run's own: keys that no page can know."""


def keys_in(value: object) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield key
            yield from keys_in(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from keys_in(inner)


def test_every_key_is_named_there(counted: StatisticsFile) -> None:
    layout = counted.layout
    counted.cells[layout.place(0) + WORST.index("step_ns")] = 1
    printed = set(keys_in(counted.statistics().as_json())) - NAMES
    printed |= system_conditions().keys() | set(Takeover.__struct_encode_fields__)
    named = {
        word
        for code in re.findall(r"`([^`\n]+)`", PAGE.read_text())
        for word in re.findall(r"\w+", code)
    }
    assert "causes" in printed
    assert sorted(printed - named) == []
