"""The fields of a recorded value by name, as outputs are compared and drawn by them."""

import math

import numpy as np
import pytest
from firmware_drivers.thrust_pairs import Forces

from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.replay.outputs import Curves, OutputDifference, Outputs, leaves
from firmware_runtime.recording.values import plain


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0.5, {"port": 0.5}),
        ((1, "a"), {"port[0]": 1, "port[1]": "a"}),
        ([1, [2]], {"port[0]": 1, "port[1][0]": 2}),
        (b"\x07", {"port[0]": 7}),
        (Forces(1.0, 2.0, 3.0, 4.0), {f"port[{place}]": place + 1.0 for place in range(4)}),
        (np.arange(2.0), {"port[0]": 0.0, "port[1]": 1.0}),
        (np.array([[1, 2]]), {"port[0][0]": 1, "port[0][1]": 2}),
        (np.float64(0.5), {"port": 0.5}),
    ],
)
def test_each_number_of_a_value_has_a_name(value: object, expected: dict[str, object]) -> None:
    assert dict(leaves("port", plain(value))) == expected


def test_what_is_no_array_though_it_is_called_one_has_names_all_the_same() -> None:
    assert dict(leaves("port", {"array": ["|O", [1], b"\x01"]})) == {
        "port.array[0]": "|O",
        "port.array[1][0]": 1,
        "port.array[2][0]": 1,
    }


def test_what_differs_is_counted_measured_and_drawn_by_field() -> None:
    outputs = Outputs(["arm.x"])
    for at, replayed in ((1, 4.0), (2, 0.5), (3, 1.0)):
        now = {"x": replayed, "state": "on"}
        outputs.compare("arm", at * SECOND, {"x": 1.0, "state": "on"}, now)
    outputs.same(["arm", "leg"])
    assert outputs.results() == {
        "arm.x": OutputDifference(2, 4, 3.0, math.sqrt(9.25 / 4), first_s=1.0, reach=1.0)
    }
    drawn = [(1.0, 1.0), (2.0, 1.0), (3.0, 1.0)], [(1.0, 4.0), (2.0, 0.5), (3.0, 1.0)]
    assert outputs.curves == {"arm.x": Curves(*drawn)}
    assert outputs.compared == 2


def test_a_field_or_a_value_on_one_side_only_is_a_difference_without_a_measure() -> None:
    outputs = Outputs()
    outputs.compare("arm", SECOND, {"x": 1, "y": math.inf}, {"x": 1, "z": math.inf})
    outputs.missing("leg", SECOND, replayed=False)
    outputs.missing("leg", 2 * SECOND, replayed=True)
    found = outputs.results()
    assert found["arm.y"] == found["arm.z"] == OutputDifference(1, 1, first_s=1.0)
    assert found["leg"] == OutputDifference(first_s=1.0, recorded_only=1, replayed_only=1)
    assert list(found) == ["leg", "arm.y", "arm.z"]  # what was not sent any more weighs most
    assert outputs.curves == {}


def test_writes_to_a_device_are_compared_in_order_and_come_after_ports() -> None:
    outputs = Outputs()
    recorded: list[object] = [[b"\x06", b"\x10"], [b"\x07\x01", 2], b"raw"]
    replayed: list[object] = [[b"\x06", b"\x14"], [b"\x07\x01", 2]]
    outputs.compare_writes("i2c1 0x40", SECOND, recorded, replayed)
    outputs.compare_writes("i2c1 0x40", SECOND, [], [b"more", b"and more"])
    outputs.compare("arm", SECOND, 1.0, 1.001)
    found = outputs.results()
    assert list(found) == ["arm", "i2c1 0x40"]
    measured = OutputDifference(1, 2, 4.0, math.sqrt(8 / 2), 1.0, 1, 2, 255.0)
    assert found["i2c1 0x40"] == measured
