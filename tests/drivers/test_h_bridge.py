from typing import TypeAlias

import pytest
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.pca9685 import Pca9685

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NotReady

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]

OFF = b"\x00\x00\x00\x10"
ON = b"\x00\x10\x00\x00"
HALF = b"\x00\x00\x00\x08"


@pytest.fixture
def registers() -> dict[int, bytearray]:
    return {0x40: bytearray(9) + b"\x10" + bytearray(246)}


@pytest.fixture
def chip(register_bus: I2cBus, wire: Wire) -> Pca9685:
    chip = Pca9685(register_bus)
    for step in HBridge(chip, 0, 1, 2).bring_up(1000):
        step.action()
    wire.clear()
    return chip


def sent(wire: Wire) -> list[bytes]:
    return [messages[0] for _, messages in wire if isinstance(messages[0], bytes)]


def test_each_order_is_one_burst_on_neighbouring_channels(chip: Pca9685, wire: Wire) -> None:
    bridge = HBridge(chip, 8, 9, 10)
    bridge.forward(0.5)
    bridge.reverse(0.5)
    bridge.brake()
    bridge.coast()
    bridge.off()
    first = bytes((0x06 + 4 * 8,))
    assert sent(wire) == [
        first + HALF + ON + OFF,
        first + HALF + OFF + ON,
        first + ON + ON + ON,
        first + ON + OFF + OFF,
        first + OFF + OFF + OFF,
    ]


@pytest.mark.parametrize(
    ("channels", "burst"),
    [
        ((13, 11, 12), ON + OFF + HALF),
        ((7, 5, 6), ON + OFF + HALF),
        ((2, 4, 3), HALF + OFF + ON),
        ((1, 2, 0), OFF + HALF + ON),
    ],
)
def test_neighbours_may_stand_in_any_order(
    chip: Pca9685, wire: Wire, channels: tuple[int, int, int], burst: bytes
) -> None:
    HBridge(chip, *channels).forward(0.5)
    assert sent(wire) == [bytes((0x06 + 4 * min(channels),)) + burst]


def test_on_channels_apart_the_pwm_is_off_while_the_inputs_change(
    chip: Pca9685, wire: Wire
) -> None:
    HBridge(chip, 0, 4, 8).reverse(0.5)
    assert sent(wire) == [
        bytes((0x06,)) + OFF,
        bytes((0x06 + 4 * 4,)) + OFF,
        bytes((0x06 + 4 * 8,)) + ON,
        bytes((0x06,)) + HALF,
    ]


@pytest.mark.parametrize("duty", [-0.1, 1.1])
def test_a_duty_that_is_none_is_refused_and_nothing_is_sent(
    chip: Pca9685, wire: Wire, duty: float
) -> None:
    with pytest.raises(ValueError, match="expected 0 to 1"):
        HBridge(chip, 8, 9, 10).forward(duty)
    assert wire == []


def test_before_bring_up_nothing_turns(register_bus: I2cBus, wire: Wire) -> None:
    with pytest.raises(NotReady, match="duties before bring-up"):
        HBridge(Pca9685(register_bus), 8, 9, 10).forward(0.5)
    assert wire == []


@pytest.mark.parametrize("channels", [(8, 8, 9), (14, 15, 16), (-1, 0, 1)])
def test_channels_that_cannot_be_are_refused(
    register_bus: I2cBus, channels: tuple[int, int, int]
) -> None:
    with pytest.raises(SettingError, match="expected three different channels from 0 to 15"):
        HBridge(Pca9685(register_bus), *channels)
