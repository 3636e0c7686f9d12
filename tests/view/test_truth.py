"""The true state of a world is said by the ports of its probe, also to those who look on."""

import pytest

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.board.rig import Truthful
from firmware_runtime.board.rigs import rig_for
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import ports_below
from firmware_runtime.executive.clocks import WorldClock


@pytest.mark.parametrize("name", ["tachobot", "detective", "pan_tilt", "balancing"])
def test_what_a_rig_says_is_what_its_probe_would_send(name: str) -> None:
    board = board_in_force(name, ())
    model = board.unconnected().model
    rig_for(board, WorldClock()).attach(model)
    probe = {
        path: port.type
        for path, port in ports_below(model).items()
        if below_root(port.path).startswith("world.")
    }
    rig = rig_for(board, WorldClock())
    assert isinstance(rig, Truthful)
    truth = rig.truth()
    assert truth.keys() == probe.keys()
    assert all(isinstance(value, probe[path]) for path, value in truth.items())
