import pytest
from firmware_drivers.chips.h_bridge import HBridge

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import NotReady
from tests.support.bare_pca9685 import BarePca9685

OFF, ON, HALF = "00 00 00 10", "00 10 00 00", "00 00 00 08"


@pytest.fixture
def bare() -> BarePca9685:
    """Return one that was brought up."""
    return BarePca9685(running=True)


def sent(bare: BarePca9685) -> list[tuple[int, str]]:
    """First channel and counts of each burst."""
    return [((data[0] - 6) // 4, data[1:].hex(" ")) for data in map(bytes, bare.written)]


def test_each_order_is_one_burst_on_neighbouring_channels(bare: BarePca9685) -> None:
    bridge = HBridge(bare.driver, 8, 9, 10)
    bridge.forward(0.5)
    bridge.reverse(0.5)
    bridge.brake()
    bridge.coast()
    bridge.off()
    assert sent(bare) == [
        (8, f"{HALF} {ON} {OFF}"),
        (8, f"{HALF} {OFF} {ON}"),
        (8, f"{ON} {ON} {ON}"),
        (8, f"{ON} {OFF} {OFF}"),
        (8, f"{OFF} {OFF} {OFF}"),
    ]


@pytest.mark.parametrize(
    ("channels", "burst"),
    [
        ((13, 11, 12), f"{ON} {OFF} {HALF}"),
        ((7, 5, 6), f"{ON} {OFF} {HALF}"),
        ((2, 4, 3), f"{HALF} {OFF} {ON}"),
        ((1, 2, 0), f"{OFF} {HALF} {ON}"),
    ],
)
def test_neighbours_may_stand_in_any_order(
    bare: BarePca9685, channels: tuple[int, int, int], burst: str
) -> None:
    HBridge(bare.driver, *channels).forward(0.5)
    assert sent(bare) == [(min(channels), burst)]


def test_on_channels_apart_the_pwm_is_off_while_the_inputs_change(bare: BarePca9685) -> None:
    HBridge(bare.driver, 0, 4, 8).reverse(0.5)
    assert sent(bare) == [(0, OFF), (4, OFF), (8, ON), (0, HALF)]


@pytest.mark.parametrize("duty", [-0.1, 1.1])
def test_a_duty_that_is_none_is_refused_and_nothing_is_sent(bare: BarePca9685, duty: float) -> None:
    with pytest.raises(ValueError, match="expected 0 to 1"):
        HBridge(bare.driver, 8, 9, 10).forward(duty)
    assert bare.sent == []


def test_before_bring_up_nothing_turns() -> None:
    bare = BarePca9685()
    with pytest.raises(NotReady, match="duties before bring-up"):
        HBridge(bare.driver, 8, 9, 10).forward(0.5)
    assert bare.sent == []


@pytest.mark.parametrize("channels", [(8, 8, 9), (14, 15, 16), (-1, 0, 1)])
def test_channels_that_cannot_be_are_refused(channels: tuple[int, int, int]) -> None:
    with pytest.raises(SettingError, match="expected three different channels from 0 to 15"):
        HBridge(BarePca9685().driver, *channels)
