"""The fields of a recorded value by name, as outputs are compared and drawn by them."""

import numpy as np
import pytest
from firmware_drivers.thrust_pairs import Forces

from firmware_runtime.recording.replay.outputs import leaves
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
