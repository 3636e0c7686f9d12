"""Whatever a part that is replayed uses of the robot's lines is noted, and refused."""

import pytest

from firmware_runtime.board.registry import load
from firmware_runtime.hal.errors import BusAbsent
from firmware_runtime.part_recording.noting_lines import noting_lines


def test_interlock_buses_and_ports_are_noted() -> None:
    uses: list[str] = []
    board = load("detective")
    lines = noting_lines(board, uses)
    assert not lines.interlock()
    with pytest.raises(BusAbsent):
        lines.buses["i2c1"].transaction(0x40, [])
    for port in lines.ports.values():
        with pytest.raises(BusAbsent):
            port.write(b"x")
        with pytest.raises(BusAbsent):
            port.read_available()
        port.close()
    assert uses[:2] == ["the interlock", "bus i2c1"]
    assert len(uses) == 2 + 2 * len(board.absent_lines().ports)
