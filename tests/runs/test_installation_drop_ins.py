"""What one board's units have beyond the templates."""

from collections.abc import Sequence

import pytest

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.errors import InstallationRefused
from firmware_runtime.host.installation.plan import GUARD, ROS2, RUNTIME, device_nodes, drop_in

SABERTOOTH = (
    'treads.driver="sabertooth"',
    'treads.port="motors"',
    "treads.address=128",
    "treads.refresh_s=0.1",
    'ports.motors={device="/dev/ttyAMA0", baud=38400}',
)


def lines(service: str, board: str, assignments: Sequence[str] = ()) -> list[str]:
    text = drop_in(service, registry.load(board, assignments), "1.2.3")
    return [line for line in text.splitlines() if not line.startswith("#")]


@pytest.mark.parametrize("board", ["detective", "tachobot"])
def test_a_run_may_open_its_bus_and_keep_the_processor_awake(board: str) -> None:
    assert lines(RUNTIME, board) == [
        "[Service]",
        "LimitRTPRIO=60",
        "DeviceAllow=/dev/i2c-1 rw",
        "TimeoutStartSec=60s",
        "WatchdogSec=2s",
        "DeviceAllow=/dev/cpu_dma_latency w",
    ]


@pytest.mark.parametrize("board", kinds.names())
def test_its_guard_comes_first_and_opens_the_bus_only(board: str) -> None:
    assert lines(GUARD, board) == [
        "[Service]",
        "LimitRTPRIO=61",
        "CPUSchedulingPriority=61",
        "DeviceAllow=/dev/i2c-1 rw",
    ]


def test_the_node_of_ros_opens_the_devices_and_has_no_priority() -> None:
    assert lines(ROS2, "tachobot") == ["[Service]", "DeviceAllow=/dev/i2c-1 rw"]


def test_a_serial_port_is_opened_by_all_three() -> None:
    for service in (RUNTIME, GUARD, ROS2):
        assert "DeviceAllow=/dev/ttyAMA0 rw" in lines(service, "detective", SABERTOOTH)


def test_an_enable_line_is_held() -> None:
    wired = ['output_enable={chip="/dev/gpiochip0", line=17}']
    assert "DeviceAllow=/dev/gpiochip0 rw" in lines(RUNTIME, "tachobot", wired)


def test_every_node_is_named_once() -> None:
    second = 'output_enable={chip="/dev/i2c-1", line=17}'
    assert device_nodes(registry.load("tachobot", [second])) == ["/dev/i2c-1"]


def test_the_guard_of_the_highest_priority_shares_it() -> None:
    highest = ["executive.fifo_priority=99"]
    assert "LimitRTPRIO=99" in lines(RUNTIME, "tachobot", highest)
    assert "CPUSchedulingPriority=99" in lines(GUARD, "tachobot", highest)


@pytest.mark.parametrize("service", [RUNTIME, GUARD])
def test_a_board_that_asks_for_no_priority_gets_none(service: str) -> None:
    asked_for = lines(service, "tachobot", ["executive.fifo_priority=0"])
    assert "LimitRTPRIO=0" in asked_for
    assert ("CPUSchedulingPolicy=other" in asked_for) is (service == GUARD)


def test_a_board_states_how_long_a_start_and_a_step_may_take() -> None:
    slow = lines(RUNTIME, "tachobot", ["executive.bring_up_s=90", "executive.watchdog_s=4.5"])
    assert {"TimeoutStartSec=90s", "WatchdogSec=4.5s"} <= set(slow)


def test_a_board_that_lets_the_processor_sleep_does_not_open_the_request() -> None:
    asleep = ["executive.keep_cpu_awake=false"]
    assert not [line for line in lines(RUNTIME, "tachobot", asleep) if "latency" in line]


@pytest.mark.parametrize(
    "node", ["/dev/i2c 1", "/dev/i2c-%i", "/dev/x\\nExecStart=/bin/sh", "/dev/../etc/shadow"]
)
def test_a_node_that_a_unit_would_misread_is_refused(node: str) -> None:
    board = registry.load("tachobot", [f'buses.i2c1.device="{node}"'])
    with pytest.raises(InstallationRefused, match="cannot stand in a unit; expected a device node"):
        drop_in(RUNTIME, board, "1.2.3")


def test_the_version_that_wrote_it_is_named() -> None:
    text = drop_in(RUNTIME, registry.load("tachobot"), "1.2.3")
    assert text.startswith("# Written by firmware-runtime 1.2.3 from /etc/firmware-runtime/")
